#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::options {
namespace {

using ::testing::HasSubstr;

enum class Colour { Red, Green };

struct Wheel {
  double radius_m = 0.3;
  [[nodiscard]] bool operator==(const Wheel&) const = default;
};
void visit(Visitor& v, Wheel& o) {
  v.number({"radius_m", "m", "of a wheel"}, o.radius_m, {0, 2, true});
}

struct Car {
  double speed_mps = 10;
  double rotation_rad = 0.1;
  double limit = std::numeric_limits<double>::infinity();
  int doors = 4;
  bool electric = false;
  Colour colour = Colour::Red;
  std::string name = "car";
  std::optional<double> load_kg;
  std::vector<std::string> owners;
  std::vector<std::string> extras{"radio"};
  Wheel spare;
  std::vector<Wheel> wheels;
  int serial = 7;  // C++ only

  [[nodiscard]] bool operator==(const Car&) const = default;
  void validate() const {
    check(*this, "car");
    if (doors > 2 && speed_mps > 50) throw InputError("too fast for its doors", "take some off");
  }
};
void visit(Visitor& v, Car& o) {
  static constexpr std::string_view kColours[]{"red", "green"};
  v.number({"speed_mps", "m/s", "along the road"}, o.speed_mps, {0, 100});
  v.angle({"turn_deg", "deg", "of the wheel"}, o.rotation_rad, {-90, 90, false, true});
  v.number({"limit", "", "of the driver"}, o.limit, or_none({1, 10}));
  v.integer({"doors", "", "of the car"}, o.doors, 0, 5);
  v.boolean({"electric", "", "no engine"}, o.electric);
  v.choice({"colour", "", "of the paint"}, o.colour, kColours);
  v.text({"name", "", "of the car"}, o.name);
  v.number({"load_kg", "kg", "in the boot", "what it carries"}, o.load_kg, {0, 500});
  v.texts({"owners", "", "one or more"}, o.owners);
  static constexpr std::string_view kExtras[]{"radio", "roof", "hook"};
  v.words({"extras", "", "built in"}, o.extras, kExtras);
  v.integer({"serial", "", ""}, o.serial, 0, 9);
  v.part("spare", o.spare);
  v.replaced("tyre", "the spare one is 'spare'");
  v.other_name("spare_m", "spare.radius_m");
  v.other_name("old.owner", "owners");
  v.list("wheels", o.wheels, [&](Wheel& wheel) {
    visit(v, wheel);
    v.former_name("size_m", "radius_m");
  });
}

struct Garage {
  Car car;
};
void visit(Visitor& v, Garage& o) {
  v.part("car", o.car);
}

template <typename Options>
Options read_text(const std::string& text) {
  Document document;
  document.file = "g.yaml";
  Options options;
  read_yaml(text, document, "", options);
  return options;
}

template <typename Options = Car>
std::string fault(const std::string& text) {
  return test::refusal([&] { (void)read_text<Options>(text); });
}

TEST(Options, ReadersFillWhatIsThereAndLeaveTheRest) {
  const Car car = read_text<Car>(
      "speed_mps: 20\nturn_deg: 45\nlimit: none\ncolour: green\nowners: Ann\nwheels: [{}, {radius_m: 1}]\n");
  EXPECT_EQ(car.speed_mps, 20);
  EXPECT_EQ(car.rotation_rad, geodesy::radians(45));
  EXPECT_TRUE(std::isinf(car.limit));
  EXPECT_EQ(car.colour, Colour::Green);
  EXPECT_EQ(car.doors, 4);
  EXPECT_THAT(car.owners, ::testing::ElementsAre("Ann"));
  ASSERT_EQ(car.wheels.size(), 2U);
  EXPECT_EQ(car.wheels[0].radius_m, 0.3);
  EXPECT_EQ(car.wheels[1].radius_m, 1);
}

TEST(Options, OtherNamesAreTheKeys) {
  const Car car = read_text<Car>("spare_m: 0.5\nold: {owner: [Ann, Bo]}\n");
  EXPECT_EQ(car.spare.radius_m, 0.5);
  EXPECT_THAT(car.owners, ::testing::ElementsAre("Ann", "Bo"));
  EXPECT_EQ(read_text<Garage>("car: {spare_m: 0.5}").car.spare.radius_m, 0.5);
  EXPECT_EQ(fault("doors: 4\nspare_m: 3\n"),
            "g.yaml:2: radius_m: 3 is out of range; it is above 0 and at most 2");
  EXPECT_EQ(fault("spare: {radius_m: 1}\nspare_m: 1\n"),
            "g.yaml:2: spare_m: conflicts with 'spare.radius_m'; keep one");
  EXPECT_EQ(read_text<Car>("wheels: [{radius_m: 0.3}, {size_m: 0.4}]").wheels.at(1).radius_m, 0.4);
  EXPECT_EQ(fault("wheels: [{radius_m: 0.3},\n  {size_m: 0.4, radius_m: 0.4}]"),
            "g.yaml:2: size_m: conflicts with 'radius_m'; keep one");
  EXPECT_EQ(describe<Car>().keys.back().meaning, "the same as owners");
  EXPECT_EQ(describe<Car>().current("wheels[].size_m"), "wheels[].radius_m");
}

TEST(Options, ReadersNameFileLineAndCure) {
  EXPECT_EQ(fault("doors: 4\nspeed_mps: 101\n"),
            "g.yaml:2: speed_mps: 101 is out of range; it is at least 0 and at most 100");
  EXPECT_THAT(fault("limit: 0.5"), HasSubstr("it is at least 1 and at most 10, or none"));
  EXPECT_THAT(fault("doors: 6"), HasSubstr("it runs from 0 to 5"));
  EXPECT_THAT(fault("serial: 1"), HasSubstr("unknown key 'serial'"));
  EXPECT_THAT(fault("spare: {radius: 1}"),
              HasSubstr("unknown key 'radius' in 'spare'; did you mean 'radius_m'"));
  EXPECT_EQ(fault("tyre: {}"), "g.yaml:1: unknown key 'tyre'; the spare one is 'spare'");
  EXPECT_EQ(fault<Garage>("car: {tyre: {}}"),
            "g.yaml:1: unknown key 'tyre' in 'car'; the spare one is 'spare'");
  EXPECT_THAT(fault("wheels: [{}, {radius_m: 3}]"), HasSubstr("g.yaml:1: radius_m: 3"));
  EXPECT_THAT(fault("electric: TrUe"), HasSubstr("'TrUe' is neither true nor false"));
  // An error that ranges cannot express is reported at the section's line.
  EXPECT_EQ(fault<Garage>("\ncar:\n  speed_mps: 60\n"), "g.yaml:2: too fast for its doors; take some off");
}

TEST(Options, WordsAreAListOfSome) {
  using ::testing::ElementsAre;
  EXPECT_THAT(read_text<Car>("extras: [hook, roof]").extras, ElementsAre("hook", "roof"));
  EXPECT_THAT(read_text<Car>("extras: hook").extras, ElementsAre("hook"));
  EXPECT_THAT(read_text<Car>("extras:").extras, ElementsAre("radio"));
  EXPECT_EQ(fault("extras: [hook, roff]"),
            "g.yaml:1: extras: 'roff' is unknown; did you mean 'roof'? known: radio, roof, hook");
  EXPECT_THAT(fault("extras: [hook, hook]"), HasSubstr("extras: 'hook' is given twice"));
  EXPECT_THAT(json_schema(describe<Car>(), "car"), HasSubstr("\"roof\""));
}

TEST(Options, BooleansAreYamls) {
  for (const char* yes : {"true", "True", "TRUE", "yes", "On", "y", "Y"})
    EXPECT_TRUE(read_text<Car>(std::string("electric: ") + yes).electric) << yes;
  for (const char* no : {"false", "No", "OFF", "n"})
    EXPECT_FALSE(read_text<Car>(std::string("electric: ") + no).electric) << no;
  EXPECT_THAT(fault("electric: 1"), HasSubstr("neither"));
  Document document;
  document.known = describe<Car>().paths();
  document.digits_are_booleans = true;
  const auto electric = [&document](const std::string& text) {
    Car car;
    read(parse_yaml("electric: " + text, document, ""), document, car);
    return car.electric;
  };
  EXPECT_TRUE(electric("1"));
  EXPECT_TRUE(electric("TrUe"));
  EXPECT_FALSE(electric("0"));
  EXPECT_THROW((void)electric("yes"), InputError);
}

TEST(Options, HostsSpeakTheirOwnLanguageAboutFaults) {
  Document document;
  document.known = describe<Car>().paths();
  document.fault = [](const std::string& path, const std::string& key, int, std::string_view problem,
                      std::string_view hint) {
    return InputError("<" + path + "><" + key + "> " + std::string(problem), hint);
  };
  document.word = "element";
  const Node root = parse_yaml("spare: {radius_m: 3}", document, "");
  Car car;
  try {
    read(root, document, car);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.problem(), "<spare><radius_m> 3 is out of range");
  }
  try {
    read(parse_yaml("speed_mps: 3 m", document, ""), document, car);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.hint(), HasSubstr("the unit is in the element's name"));
  }
}

TEST(Options, ChecksNameFieldAndBound) {
  const test::SpoiledOptions<Car> message;
  EXPECT_EQ(message([](Car&) {}), "");
  EXPECT_EQ(message([](Car& c) { c.speed_mps = -1; }),
            "speed_mps of the car is -1; it must be at least 0 and at most 100 m/s");
  EXPECT_EQ(message([](Car& c) { c.rotation_rad = 2; }),
            "turn_rad of the car is 2 (114.591559 deg); it must be at least -90 and below 90 deg");
  EXPECT_THAT(message([](Car& c) { c.speed_mps = std::nan(""); }), HasSubstr("speed_mps"));
  EXPECT_THAT(message([](Car& c) { c.speed_mps = INFINITY; }), HasSubstr("speed_mps"));
  EXPECT_THAT(message([](Car& c) { c.colour = static_cast<Colour>(2); }), HasSubstr("one of red, green"));
  EXPECT_THAT(message([](Car& c) { c.serial = 10; }), HasSubstr("serial"));
  EXPECT_THAT(message([](Car& c) { c.spare.radius_m = 0; }), HasSubstr("spare.radius_m"));
  EXPECT_THAT(message([](Car& c) { c.wheels = {{1}, {0}}; }), HasSubstr("wheels.1.radius_m"));
}

TEST(Options, TextsReadBackToTheBit) {
  Car car;
  car.speed_mps = 1.0 / 3;
  car.rotation_rad = geodesy::radians(12.345678901234567);
  car.name = "a: \"b\\c\" # d\n";
  car.owners = {"true", "12", "- x", "Zoe \xc3\xab"};
  car.load_kg = 0;
  car.wheels = {{0.5}, {1e-300}};
  EXPECT_EQ(read_text<Car>(yaml(car)), car) << yaml(car);
  EXPECT_NE(exact_text(car), exact_text(Car()));
  Car other = car;
  other.serial = 8;
  EXPECT_NE(exact_text(other), exact_text(car));
  EXPECT_EQ(yaml(other), yaml(car));
}

TEST(Options, AnglesThatDegreesMadeAreFoundAgain) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-180, 180);
  for (int i = 0; i < 10'000; ++i) {
    const double radians = geodesy::radians(any(random));
    ASSERT_EQ(geodesy::radians(exact_degrees(radians)), radians);
  }
  EXPECT_EQ(show(exact_degrees(geodesy::radians(22.298251))), "22.298251");
  EXPECT_EQ(show(exact_degrees(0.17453292519943295)), "10");
}

TEST(Options, TablesSayUnitDefaultValuesAndMeaning) {
  EXPECT_THAT(markdown(describe<Car>().keys),
              ::testing::AllOf(HasSubstr("| `speed_mps` | m/s | 10 | [0, 100] | along the road |\n"),
                               HasSubstr("| `limit` |  | none | [1, 10], or none | of the driver |\n"),
                               HasSubstr("| `colour` |  | red | red, green | of the paint |\n"),
                               HasSubstr("| `load_kg` | kg | what it carries | [0, 500] | in the boot |\n"),
                               HasSubstr("| `wheels[].radius_m` | m | 0.3 | (0, 2] | of a wheel |\n"),
                               ::testing::Not(HasSubstr("serial"))));
}

TEST(Options, SchemasHaveTheSameBounds) {
  const auto schema = nlohmann::json::parse(json_schema(describe<Car>(), "car"));
  EXPECT_EQ(schema["properties"]["speed_mps"]["maximum"], 100);
  EXPECT_EQ(schema["properties"]["turn_deg"]["exclusiveMaximum"], 90);
  EXPECT_EQ(schema["properties"]["limit"]["anyOf"][1]["const"], "none");
  EXPECT_EQ(schema["properties"]["wheels"]["items"]["properties"]["radius_m"]["exclusiveMinimum"], 0);
  EXPECT_EQ(schema["additionalProperties"], false);
}

// Ten levels of ten aliases would be 10^10 nodes.
TEST(Yaml, RefusesTreesThatAliasesBlowUp) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int k = 1; k < 10; ++k) bomb += ", " + before;
    bomb += "]\n";
  }
  EXPECT_THROW((void)parse_yaml(bomb, {}, ""), InputError);
  EXPECT_THROW((void)parse_yaml("a: &a [*a]\n", {}, ""), InputError);
}

// At such a comma yaml-cpp finds an empty document, then the next one at the same position, without end.
TEST(ParseYaml, EndsAtACommaThatStandsAlone) {
  for (const char* text : {"a: 1\n , b: 2\n", " , b: 2\n", "a: 1\n---\nb: 2\n"}) {
    EXPECT_THROW((void)parse_yaml(text, {}, ""), InputError) << text;
  }
}

// yaml-cpp reads some of these as the end of its input, and started documents without end.
TEST(ParseYaml, RefusesBytesThatAreNoText) {
  for (const char bad : {'\0', '\x04', '\x1a', '\x7f'}) {
    const std::string text = std::string("a: 1\nb: ") + bad + " 2\n";
    try {
      (void)parse_yaml(text, {}, "");
      ADD_FAILURE() << static_cast<int>(bad);
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), 2);
      EXPECT_NE(error.problem().find("is not text"), std::string::npos);
    }
  }
}

Node tree_of(const std::string& yaml) {
  Document document;
  document.file = "text";
  return parse_yaml(yaml, document, "");
}

TEST(SettingsTree, SetsValuesSectionsAndItems) {
  Node root = tree_of("{a: {b: 1}, list: [{name: x, k: 1}, {name: y}]}");
  set_at(root, "a.b", scalar_node("2"));
  set_at(root, "a.new.deep", scalar_node("3"));
  set_at(root, "list[].k", scalar_node("7"));
  set_at(root, "list[y].k", scalar_node("8"));
  set_at(root, "list[0].m", tree_of("{p: [1, 2]}"));
  EXPECT_EQ(flow_text(root),
            "{a: {b: 2, new: {deep: 3}}, list: [{name: x, k: 7, m: {p: [1, 2]}}, {name: y, k: 8}]}");
  EXPECT_THAT(test::refusal([&] { set_at(root, "list[5].k", scalar_node("1")); }), HasSubstr("no item 5"));
  EXPECT_THAT(test::refusal([&] { set_at(root, "a.b.c", scalar_node("1")); }), HasSubstr("is not a section"));
}

// A tree written on one line reads back as the same tree.
TEST(SettingsTree, FlowTextReadsBack) {
  const Node root = tree_of("{a: \"x: y\", b: [\"{\", \"say \\\"so\\\"\", \" blank \"], c: -1.5e-3}");
  EXPECT_EQ(flow_text(tree_of(flow_text(root))), flow_text(root));
  EXPECT_EQ(tree_of(flow_text(root)).find("a")->value.text, "x: y");
}

}  // namespace
}  // namespace canyon::options
