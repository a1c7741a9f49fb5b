#include "canyon/outputs/view/header.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace canyon::view {
namespace {

TEST(ViewHeader, NamesEveryTableAndColumnAndHasNoNaN) {
  ViewHeader header;
  header.title = "a \"title\"";
  header.receivers.push_back({"car", true, 10, {{"jammer", 1, 2}}, {}});
  header.receivers.back().summary.horizontal_p50_m = std::numeric_limits<double>::quiet_NaN();
  const std::string json = header_json(header);
  for (const encoding::ViewTable& table : encoding::view_tables()) {
    EXPECT_THAT(json, testing::HasSubstr("\"" + std::string(table.name) + "\""));
    for (const encoding::ViewColumn& column : table.columns) {
      EXPECT_THAT(json, testing::HasSubstr("\"name\":\"" + std::string(column.name) + "\""));
    }
  }
  EXPECT_THAT(json, testing::HasSubstr("\"horizontal_p50_m\":null"));
  for (const encoding::SummaryMetric& metric : encoding::summary_metrics()) {
    if (*metric.label == '\0') continue;
    EXPECT_THAT(json, testing::HasSubstr("{\"name\":\"" + std::string(metric.name) + "\",\"label\""));
  }
  EXPECT_THAT(json, testing::HasSubstr("\"visibility\":[\"LOS\",\"LOS+multipath\",\"NLOS\",\"blocked\"]"));
  EXPECT_THAT(json, testing::HasSubstr("\"time\":null"));
}

}  // namespace
}  // namespace canyon::view
