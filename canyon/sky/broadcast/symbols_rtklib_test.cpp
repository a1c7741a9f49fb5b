// RTKLIB 2.4.3 b34 reads SBAS messages: preamble and parity.
#include <gtest/gtest.h>

#include <array>

#include "canyon/sky/broadcast/messages.hpp"
#include "tests/support/rtklib.hpp"

extern "C" {
struct RtklibSbasMessage {
  int week, tow;
  unsigned char prn, receiver;
  unsigned char msg[29];  ///< 226 bits
};
/// @param words 250 bits: seven words of 32 and one of 26 @return 1, or 0 if preamble or parity is wrong
int sbsdecodemsg(RtklibTime time, int prn, unsigned int* words, RtklibSbasMessage* message);
}

namespace canyon::broadcast {
namespace {

TEST(SbasByRtklib, MessagesHavePreambleAndParity) {
  gnss::SbasEphemeris e;
  e.position_m = {4.2e7 - 1e6, -5e6, 1e4};
  for (int second = 0; second < 6; ++second) {
    const geodesy::GpsTime start = geodesy::GpsTime::from_week(2421, 115200 + second);
    for (const int type : {0, 9, 63}) {
      const Bits bits = sbas_message(e, type, start);
      std::array<unsigned int, 8> words{};
      for (std::size_t i = 0; i < 7; ++i) words[i] = static_cast<unsigned int>(bits.number(32 * i, 32));
      words[7] = static_cast<unsigned int>(bits.number(224, 26));
      RtklibSbasMessage message{};
      ASSERT_EQ(sbsdecodemsg(test::rtklib_time(start), 120, words.data(), &message), 1)
          << second << ' ' << type;
      EXPECT_EQ(message.tow, 115200 + second);
      EXPECT_EQ(message.msg[1] >> 2, type);
      words[3] ^= 1U;
      EXPECT_EQ(sbsdecodemsg(test::rtklib_time(start), 120, words.data(), &message), 0);
    }
  }
}

}  // namespace
}  // namespace canyon::broadcast
