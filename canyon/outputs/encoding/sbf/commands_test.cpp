#include "canyon/outputs/encoding/sbf/commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/outputs/encoding/sbf/block.hpp"

namespace canyon::encoding::sbf {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string send(SbfCommands& commands, std::string_view bytes) {
  return commands.receive(bytes, 0);
}

TEST(SbfCommands, AreAnsweredAsTheReceiverDoes) {
  SbfCommands commands;
  EXPECT_EQ(send(commands, "\n\r"), "COM1>COM1>");
  EXPECT_EQ(send(commands, "SSSSSSSSSS\n"), "COM1>");
  EXPECT_EQ(send(commands, "setDataInOut, COM1, Auto, SBF\n"), "$R: setDataInOut, COM1, Auto, SBF\r\nCOM1>");
  EXPECT_EQ(send(commands, "makeCoffee\n"), "$R? makecoffee: Invalid command!\r\nCOM1>");
  EXPECT_THAT(send(commands, "sno, all, none, none, off\n"), HasSubstr("$R: sno"));
  EXPECT_THAT(send(commands, "sno, Stream1, COM1, GGA, sec1\n"), HasSubstr("'Messages' is invalid"));
  EXPECT_THAT(send(commands, "grc\n"), HasSubstr("ReceiverCapabilities"));
  EXPECT_EQ(send(commands, "login, anyone, secret\r"), "$R: login\r\nCOM1>");
  EXPECT_EQ(send(commands, "setPVT"), "") << "cut anywhere";
  EXPECT_THAT(send(commands, "Mode, Static\n"), HasSubstr("$R: setPVTMode, Static"));
}

TEST(SbfCommands, OutputIsAllUntilItIsChosen) {
  SbfCommands commands;
  EXPECT_TRUE(commands.is_due(kDop.number, 0));
  EXPECT_TRUE(commands.sends(kGpsRawCa.number));
  (void)send(commands, "\n\xD3...");
  EXPECT_TRUE(commands.is_due(kDop.number, 0));
  (void)send(commands, "S\nSSSSSSSSS\n");
  EXPECT_TRUE(commands.is_due(kDop.number, 0)) << "ten letters ask for the command line";
  EXPECT_EQ(commands.first(), "");
  (void)send(commands, "\nSSSSSSSSSS\n");
  EXPECT_EQ(commands.first(), "SSSSSSSSSS");
  EXPECT_FALSE(commands.is_due(kDop.number, 0));
  EXPECT_EQ(send(commands, "setSBFOutput, Stream1, COM1, PVTGeodetic+DOP+Comment, msec500\n"),
            "$R: setSBFOutput, Stream1, COM1, PVTGeodetic+DOP+Comment, msec500\r\n"
            "  SBFOutput, Stream1, COM1, PVTGeodetic+DOP, msec500\r\nCOM1>");
  EXPECT_FALSE(commands.is_due(kMeasEpoch.number, 0));
  EXPECT_FALSE(commands.sends(kGpsRawCa.number));
  int sent = 0;
  for (std::int64_t ms = 0; ms < 1500; ms += 100) sent += commands.is_due(kDop.number, ms) ? 1 : 0;
  EXPECT_EQ(sent, 0);
  for (std::int64_t ms = 1500; ms < 3500; ms += 100) sent += commands.is_due(kDop.number, ms) ? 1 : 0;
  EXPECT_EQ(sent, 4);
  (void)send(commands, "sso, Stream1, COM1, +GPSRawCA-DOP\nsso, Stream2, COM1, MeasEpoch, OnChange\n");
  EXPECT_FALSE(commands.is_due(kDop.number, 5000));
  EXPECT_TRUE(commands.is_due(kPvtGeodetic.number, 5000));
  EXPECT_TRUE(commands.sends(kGpsRawCa.number));
  EXPECT_TRUE(commands.is_due(kMeasEpoch.number, 5000) && commands.is_due(kMeasEpoch.number, 5001));
  (void)send(commands, "sso, all, none, none, off\n");
  EXPECT_FALSE(commands.is_due(kPvtGeodetic.number, 9000));
  EXPECT_THAT(send(commands, "sso, Stream1, COM1, DOP, fortnightly\n"),
              HasSubstr("$R? setSBFOutput: Argument 'Interval' is invalid!"));
}

TEST(SbfCommands, SpeedAndRestarts) {
  SbfCommands commands;
  (void)send(commands, "scs, COM1, baud460800\n");
  EXPECT_EQ(commands.take_baud(), 460800);
  EXPECT_EQ(commands.take_baud(), std::nullopt);
  EXPECT_THAT(send(commands, "scs, COM1, baudfast\n"), HasSubstr("Argument 'Rate' is invalid!"));
  (void)send(commands, "exeResetReceiver, soft, none\n");
  EXPECT_EQ(commands.take_restart(), disturbance::RestartKind::Hot);
  (void)send(commands, "exeResetReceiver, hard, SatData\n");
  EXPECT_EQ(commands.take_restart(), disturbance::RestartKind::Cold);
  EXPECT_EQ(commands.take_restart(), std::nullopt);
}

// RTCM 3 arrives on the same line. Its bytes are not commands; a command after them is.
TEST(SbfCommands, OtherBytesAreNotCommands) {
  SbfCommands commands;
  EXPECT_EQ(send(commands, std::string("\xD3\x00\x13", 3) + "sso, all, none\nab\n7,8,9\n"), "");
  EXPECT_EQ(send(commands, "setPVTMode, Static\n"), "$R: setPVTMode, Static\r\nCOM1>");
  EXPECT_THAT(send(commands, std::string(5000, 'x') + "\n"), Not(HasSubstr("xxx")));
}

}  // namespace
}  // namespace canyon::encoding::sbf
