#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "canyon/base/text_file.hpp"
#include "tests/support/damaged_city.hpp"
#include "tests/support/shared_data.hpp"

// Parts of published maps with a byte left out, or a line doubled or left out: they give the same
// city, a city within a metre, a remark or an error.
namespace canyon::damaged_recorded_cities_test {
namespace {

constexpr std::size_t kEvery = 61;

/// What nobody can know: a digit within the plausible range, a tag or a corner that is missing.
void expect_few_silent(const char* name, const std::string& text, double most_share) {
  const test::DamageCounts counts = test::DamagedCity(name, text).run(kEvery);
  EXPECT_GT(counts.files, 100);
  EXPECT_LE(static_cast<double>(counts.silent.size()), most_share * counts.files)
      << testing::PrintToString(counts.silent);
}

std::string attribute_of(std::string_view element, std::string_view name) {
  const std::string key = fmt::format(" {}=\"", name);
  const std::size_t at = element.find(key);
  if (at == std::string_view::npos) return {};
  const std::size_t begin = at + key.size();
  return std::string(element.substr(begin, element.find('"', begin) - begin));
}

/// The first ways of OpenStreetMap XML with a tag `building`, with their nodes.
std::string first_buildings(const std::filesystem::path& path, std::size_t count) {
  const std::string text(TextFile(path).text());
  std::string ways;
  std::set<std::string> nodes;
  std::size_t found = 0;
  for (std::size_t at = text.find("<way "); at != std::string::npos && found < count;
       at = text.find("<way ", at + 1)) {
    const std::string way = text.substr(at, text.find("</way>", at) + 6 - at);
    if (way.find("k=\"building\"") == std::string::npos) continue;
    ways += " " + way + "\n";
    ++found;
    for (std::size_t nd = way.find("<nd "); nd != std::string::npos; nd = way.find("<nd ", nd + 1))
      nodes.insert(attribute_of(std::string_view(way).substr(nd, way.find('>', nd) - nd), "ref"));
  }
  std::string all = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<osm version=\"0.6\">\n";
  for (std::size_t at = text.find("<node "); at != std::string::npos; at = text.find("<node ", at + 1)) {
    const std::size_t end = text.find('>', at);
    const std::string node = text.substr(at, end - at);
    if (nodes.count(attribute_of(node, "id")) == 0) continue;
    all += " " + (node.back() == '/' ? node + ">" : node + "/>") + "\n";
  }
  return all + ways + "</osm>\n";
}

TEST(DamagedRecordedCities, OpenStreetMap) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  expect_few_silent("moscow.osm", first_buildings(path, 12), 0.12);
}

/// Some buildings of a CityJSON file, a number a line.
std::string some_objects(const std::filesystem::path& path, std::size_t first, std::size_t count) {
  auto city = nlohmann::ordered_json::parse(std::string(TextFile(path).text()));
  auto objects = nlohmann::ordered_json::object();
  auto vertices = nlohmann::ordered_json::array();
  std::size_t number = 0;
  for (auto& [id, object] : city["CityObjects"].items()) {
    if (number++ < first || objects.size() == count) continue;
    const std::function<void(nlohmann::ordered_json&)> renumber = [&](nlohmann::ordered_json& boundary) {
      if (boundary.is_array()) {
        for (auto& inner : boundary) renumber(inner);
        return;
      }
      vertices.push_back(city["vertices"][boundary.get<std::size_t>()]);
      boundary = vertices.size() - 1;
    };
    for (auto& geometry : object["geometry"]) renumber(geometry["boundaries"]);
    objects[id] = object;
  }
  city["CityObjects"] = objects;
  city["vertices"] = vertices;
  return city.dump(0);
}

TEST(DamagedRecordedCities, CityJson) {
  CANYON_SHARED_DATA(path, "berlin-potsdamer-platz/buildings.city.json");
  expect_few_silent("berlin.city.json", some_objects(path, 100, 2), 0.01);
}

TEST(DamagedRecordedCities, CityGml) {
  CANYON_SHARED_DATA(path, "citygml-plateau/53392642_bldg_6697_op2.gml");
  const std::string text(TextFile(path).text());
  const std::string_view end = "</core:cityObjectMember>";
  const std::size_t first = text.find(end) + end.size();
  const std::size_t second = text.find(end, first) + end.size();
  const std::size_t head = text.find("<core:cityObjectMember>");
  expect_few_silent("plateau.gml",
                    text.substr(0, head) + text.substr(first, second - first) + "\n</core:CityModel>\n",
                    0.01);
}

}  // namespace
}  // namespace canyon::damaged_recorded_cities_test
