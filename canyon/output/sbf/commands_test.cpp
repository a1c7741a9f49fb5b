#include "canyon/output/sbf/commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/output/sbf/block.hpp"

namespace canyon::output::sbf {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(SbfCommands, AreAnsweredAsTheReceiverDoes) {
  Commands commands;
  EXPECT_EQ(commands.receive(1, "\n\r"), "COM1>COM1>");
  EXPECT_EQ(commands.receive(1, "SSSSSSSSSS\n"), "COM1>");
  EXPECT_EQ(commands.receive(1, "setDataInOut, COM1, Auto, SBF\n"),
            "$R: setDataInOut, COM1, Auto, SBF\r\nCOM1>");
  EXPECT_EQ(commands.receive(1, "makeCoffee\n"), "$R? makecoffee: Invalid command!\r\nCOM1>");
  EXPECT_THAT(commands.receive(1, "sno, all, none, none, off\n"), HasSubstr("$R: sno"));
  EXPECT_THAT(commands.receive(1, "sno, Stream1, COM1, GGA, sec1\n"), HasSubstr("'Messages' is invalid"));
  EXPECT_THAT(commands.receive(1, "grc\n"), HasSubstr("ReceiverCapabilities"));
  // Cut anywhere; each reader has its own line.
  EXPECT_EQ(commands.receive(1, "setPVT"), "");
  EXPECT_EQ(commands.receive(2, "login, anyone, secret\r"), "$R: login\r\nCOM1>");
  EXPECT_THAT(commands.receive(1, "Mode, Static\n"), HasSubstr("$R: setPVTMode, Static"));
}

TEST(SbfCommands, OutputIsAllUntilItIsChosen) {
  Commands commands;
  EXPECT_TRUE(commands.is_due(kDop.number, 0));
  EXPECT_TRUE(commands.sends(kGpsRawCa.number));
  (void)commands.receive(1, "\n\xD3...");
  EXPECT_TRUE(commands.is_due(kDop.number, 0));
  (void)commands.receive(1, "\nSSSSSSSSSS\n");
  EXPECT_FALSE(commands.is_due(kDop.number, 0));
  EXPECT_EQ(commands.receive(1, "setSBFOutput, Stream1, COM1, PVTGeodetic+DOP+Comment, msec500\n"),
            "$R: setSBFOutput, Stream1, COM1, PVTGeodetic+DOP+Comment, msec500\r\n"
            "  SBFOutput, Stream1, COM1, PVTGeodetic+DOP, msec500\r\nCOM1>");
  EXPECT_FALSE(commands.is_due(kMeasEpoch.number, 0));
  EXPECT_FALSE(commands.sends(kGpsRawCa.number));
  int sent = 0;
  for (std::int64_t ms = 0; ms < 1500; ms += 100) sent += commands.is_due(kDop.number, ms) ? 1 : 0;
  EXPECT_EQ(sent, 0);
  for (std::int64_t ms = 1500; ms < 3500; ms += 100) sent += commands.is_due(kDop.number, ms) ? 1 : 0;
  EXPECT_EQ(sent, 4);
  (void)commands.receive(1, "sso, Stream1, COM1, +GPSRawCA-DOP\nsso, Stream2, COM1, MeasEpoch, OnChange\n");
  EXPECT_FALSE(commands.is_due(kDop.number, 5000));
  EXPECT_TRUE(commands.is_due(kPvtGeodetic.number, 5000));
  EXPECT_TRUE(commands.sends(kGpsRawCa.number));
  EXPECT_TRUE(commands.is_due(kMeasEpoch.number, 5000) && commands.is_due(kMeasEpoch.number, 5001));
  (void)commands.receive(1, "sso, all, none, none, off\n");
  EXPECT_FALSE(commands.is_due(kPvtGeodetic.number, 9000));
  EXPECT_THAT(commands.receive(1, "sso, Stream1, COM1, DOP, fortnightly\n"),
              HasSubstr("$R? setSBFOutput: Argument 'Interval' is invalid!"));
}

TEST(SbfCommands, SpeedAndRestarts) {
  Commands commands;
  (void)commands.receive(1, "scs, COM1, baud460800\n");
  EXPECT_EQ(commands.take_baud(), 460800);
  EXPECT_EQ(commands.take_baud(), std::nullopt);
  EXPECT_THAT(commands.receive(1, "scs, COM1, baudfast\n"), HasSubstr("Argument 'Rate' is invalid!"));
  (void)commands.receive(1, "exeResetReceiver, soft, none\n");
  EXPECT_EQ(commands.take_restart(), disturbance::RestartKind::Hot);
  (void)commands.receive(1, "exeResetReceiver, hard, SatData\n");
  EXPECT_EQ(commands.take_restart(), disturbance::RestartKind::Cold);
  EXPECT_EQ(commands.take_restart(), std::nullopt);
}

// RTCM 3 comes on the same line. Its bytes are not commands, and a command behind them is one.
TEST(SbfCommands, OtherBytesAreNotCommands) {
  Commands commands;
  EXPECT_EQ(commands.receive(1, std::string("\xD3\x00\x13", 3) + "sso, all, none\nab\n7,8,9\n"), "");
  EXPECT_EQ(commands.receive(1, "setPVTMode, Static\n"), "$R: setPVTMode, Static\r\nCOM1>");
  EXPECT_THAT(commands.receive(1, std::string(5000, 'x') + "\n"), Not(HasSubstr("xxx")));
}

}  // namespace
}  // namespace canyon::output::sbf
