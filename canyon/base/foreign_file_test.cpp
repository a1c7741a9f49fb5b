#include "canyon/base/foreign_file.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace canyon {
namespace {

using namespace std::string_view_literals;

TEST(ForeignFile, ByTheFirstBytes) {
  const std::pair<std::string_view, std::string_view> heads[] = {
      {"\xd4\xc3\xb2\xa1\x02\x00"sv, "a capture of network packets (PCAP)"},
      {"\xa1\xb2\x3c\x4d\x00\x02"sv, "a capture of network packets (PCAP)"},
      {"\x0a\x0d\x0d\x0a\x1c"sv, "a capture of network packets (PCAP)"},
      {"{\"global\": {\"core:datatype\": \"ci16_le\"}}", "a recording of radio samples (SigMF)"},
      {"\x89MCAP0\r\n", "a bag of ROS 2"},
      {"#BESTPOSA,COM1,0,83.5,FINESTEERING,2312,295218.000,0,cdba,32768;SOL_COMPUTED,SINGLE,48.1*6f\n",
       "a text log of a NovAtel or Unicore receiver"},
      {"%INSPVASA,2312,295218.000;2312,295218.0,48.1,11.2,547.0,INS_SOLUTION_GOOD*00000000\n",
       "a text log of a NovAtel or Unicore receiver"},
      {"SOURCETABLE 200 OK\r\nSTR;M;City;RTCM 3.2;", "an NTRIP caster's list of streams"},
      {"HTTP/1.1 401 Unauthorized\r\n", "a server's answer with its header lines (HTTP, NTRIP)"},
      {"QGC WPL 110\n0\t1\t0", "a plan of a flight (QGroundControl, Mission Planner)"},
      {R"({"fileType":"Plan","groundStation":"QGroundControl"})",
       "a plan of a flight (QGroundControl, Mission Planner)"},
      {"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n",
       "a log of ArduPilot as text (DataFlash)"},
      {R"({"class":"TPV","mode":3})", "a log of gpsd (JSON)"},
      {R"({"locations": [{"latitudeE7": 481000000}]})", "the places of a Google account (Takeout)"},
      {"\xA0\xA2\x00\x03"sv, "a raw log of a receiver's maker"},
      {"LASF\0\0\0\0"sv, "a cloud of points (LAS)"},
      {"\0\0\x27\x0a\0\0"sv, "a part of an Esri shapefile"},
      {"  0\r\nSECTION\r\n", "a drawing (DXF)"},
      {"AC1027\0\0"sv, "a drawing (DWG)"},
      {"ISO-10303-21;\nHEADER;", "a building model (IFC)"},
      {"<?xml version='1.0'?><robot name='a'>", "a robot (URDF)"},
      {"RIFF\x24\0\0\0WAVEfmt "sv, "a sound file (WAV)"},
      {"%=BIA 1.00 COD 2024:122:00000",
       "a file of antennas, ionosphere, biases or stations (ANTEX, IONEX, SINEX)"},
      {"******** Week 264 almanac for PRN-01 ********\n", "an almanac (YUMA)"}};
  for (const auto& [head, name] : heads) {
    const ForeignFile* const found = foreign_file(head);
    ASSERT_NE(found, nullptr) << name;
    EXPECT_EQ(found->name, name);
    EXPECT_FALSE(found->use.empty()) << name;
  }
  for (const std::string_view head : {"", "time,lat,lon\n", "AC1027,1,2", "# a comment; of a table*\n",
                                      "{\"a\": 1}", "\xd4", "FMT,lat,lon\n", "ICY 200 OK\r\n\r\n\xD3\x01"})
    EXPECT_EQ(foreign_file(head), nullptr) << head;
}

TEST(ForeignFile, ByTheEndingOfTheName) {
  ASSERT_NE(foreign_ending(".sigmf-data"), nullptr);
  EXPECT_EQ(foreign_ending(".DBF")->name, "a part of an Esri shapefile");
  EXPECT_EQ(foreign_ending(".csv"), nullptr);
  EXPECT_EQ(foreign_ending(""), nullptr);
}

}  // namespace
}  // namespace canyon
