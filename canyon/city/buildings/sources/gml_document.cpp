// The only file that uses expat.
#include "canyon/city/buildings/sources/gml_document.hpp"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

constexpr std::size_t kDeepest = 200;
constexpr std::size_t kMaxText = 4096;  // without coordinates

/// Elements that are not built.
const std::set<std::string_view> kPassedOver{
    "appearance",          "appearanceMember", "address",
    "interiorRoom",        "buildingRoom",     "interiorFurniture",
    "buildingFurniture",   "roomInstallation", "interiorBuildingInstallation",
    "interiorBridgeRoom",  "bridgeRoom",       "interiorBridgeInstallation",
    "interiorHollowSpace", "hollowSpace",      "interiorTunnelInstallation",
    "buildingSubdivision"};

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool holds_coordinates(std::string_view name) {
  return is_one_of(name, {"posList", "pos", "coordinates", "lowerCorner", "upperCorner"});
}

std::string_view local_name(const char* name) {
  const char* colon = std::strrchr(name, ':');
  return colon == nullptr ? name : colon + 1;
}

struct FreeParser {
  void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
};

class GmlParser {
 public:
  GmlParser(const std::filesystem::path& file, const GmlSink& sink)
      : file_(file), sink_(sink), parser_(XML_ParserCreate(nullptr)) {
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), &GmlParser::on_begin, &GmlParser::on_end);
    XML_SetCharacterDataHandler(parser_.get(), &GmlParser::on_text);
    XML_SetEntityDeclHandler(parser_.get(), &GmlParser::on_entity);
  }

  void read(const ByteReader& bytes) {
    constexpr int kChunk = 1 << 18;
    for (bool more = true; more;) {
      void* buffer = XML_GetBuffer(parser_.get(), kChunk);
      if (buffer == nullptr) throw std::bad_alloc();
      const std::size_t n = bytes(static_cast<char*>(buffer), kChunk);
      more = n > 0;
      const XML_Status status = XML_ParseBuffer(parser_.get(), static_cast<int>(n), more ? 0 : 1);
      if (failure_) std::rethrow_exception(failure_);
      if (ended_) return;
      if (status != XML_STATUS_OK) fail_xml(n == 0);
    }
  }

 private:
  struct Open {
    GmlElement element;
    int dimension = 0;        ///< srsDimension in effect here; 0: none
    bool has_system = false;  ///< given here
  };

  [[noreturn]] void fail(std::string_view problem, std::string_view hint) const {
    throw InputError(file_, line(), problem, hint);
  }
  [[nodiscard]] int line() const { return static_cast<int>(XML_GetCurrentLineNumber(parser_.get())); }

  [[noreturn]] void fail_xml(bool at_end) const {
    const XML_Error code = XML_GetErrorCode(parser_.get());
    if (at_end || code == XML_ERROR_NO_ELEMENTS || code == XML_ERROR_UNCLOSED_TOKEN)
      fail("is cut short", "fetch the file again");
    if (code == XML_ERROR_UNKNOWN_ENCODING) fail("is in an unsupported encoding", "save it as UTF-8");
    fail(fmt::format("is not well-formed XML ({})", XML_ErrorString(code)),
         "fetch the file again, or export it again");
  }

  // Expat is C: exceptions must not pass through it.
  template <typename Act>
  static void guard(void* self, const Act& act) {
    GmlParser& parser = *static_cast<GmlParser*>(self);
    if (parser.failure_ || parser.ended_) return;
    try {
      act(parser);
    } catch (...) {
      parser.failure_ = std::current_exception();
    }
    if (parser.failure_ || parser.ended_) XML_StopParser(parser.parser_.get(), XML_FALSE);
  }
  static void on_begin(void* self, const XML_Char* name, const XML_Char** attributes) {
    guard(self, [&](GmlParser& parser) { parser.begin(local_name(name), attributes); });
  }
  static void on_end(void* self, const XML_Char*) {
    guard(self, [](GmlParser& parser) { parser.end(); });
  }
  static void on_text(void* self, const XML_Char* text, int length) {
    guard(self, [&](GmlParser& parser) { parser.add_text({text, static_cast<std::size_t>(length)}); });
  }
  static void on_entity(void* self, const XML_Char* name, int, const XML_Char*, int, const XML_Char*,
                        const XML_Char*, const XML_Char*, const XML_Char*) {
    guard(self, [&](GmlParser& parser) {
      parser.fail(fmt::format("declares the entity '{}', which is not supported", name),
                  "city models need none: remove the declaration");
    });
  }

  void begin(std::string_view name, const XML_Char** attributes) {
    if (passed_over_ > 0 || kPassedOver.count(name) > 0) {
      ++passed_over_;
      if (passed_over_ > kDeepest) fail("has elements that are nested too deeply", "is it a city model?");
      return;
    }
    if (stack_.size() >= kDeepest) fail("has elements that are nested too deeply", "is it a city model?");
    if (stack_.empty() && name != "CityModel" && name != "FeatureCollection") {
      fail(fmt::format("is XML, but not CityGML: its first element is {}", name),
           "give a file whose first element is CityModel");
    }
    Open open;
    open.element.name = name;
    if (!stack_.empty()) {
      open.element.system = stack_.back().element.system;
      open.dimension = stack_.back().dimension;
    }
    for (const XML_Char** a = attributes; *a != nullptr; a += 2) set_attribute(open, local_name(a[0]), a[1]);
    stack_.push_back(std::move(open));
    if (name == "Envelope" && stack_.back().has_system) hand_system_up();
  }

  void set_attribute(Open& open, std::string_view name, std::string_view value) {
    if (name == "id") {
      open.element.id = value;
    } else if (name == "href") {
      open.element.href = value;
    } else if (name == "name") {
      open.element.key = value;
    } else if (name == "uom") {
      open.element.unit = value;
    } else if (name == "orientation") {
      open.element.reversed = value == "-";
    } else if (name == "srsName" && !value.empty()) {
      open.element.system = interned(value);
      open.has_system = true;
    } else if (name == "srsDimension") {
      open.dimension = static_cast<int>(std::clamp(parse_integer(value).value_or(0), 0LL, 4LL));
    }
  }

  /// One copy of each name of a reference system.
  std::shared_ptr<const std::string> interned(std::string_view name) {
    const auto found =
        std::find_if(systems_.begin(), systems_.end(), [name](const auto& known) { return *known == name; });
    return found != systems_.end() ? *found
                                   : systems_.emplace_back(std::make_shared<const std::string>(name));
  }

  /// The box of an object gives the reference system of the whole object.
  void hand_system_up() {
    if (stack_.size() < 3) return;
    Open& object = stack_[stack_.size() - 3];
    if (object.has_system) return;
    object.element.system = stack_.back().element.system;
    if (object.dimension == 0) object.dimension = stack_.back().dimension;
    object.has_system = true;
  }

  void add_text(std::string_view text) {
    if (passed_over_ > 0 || stack_.empty()) return;
    GmlElement& element = stack_.back().element;
    if (!holds_coordinates(element.name) && element.text.size() + text.size() > kMaxText) return;
    element.text += text;
  }

  void end() {
    if (passed_over_ > 0) {
      --passed_over_;
      return;
    }
    Open open = std::move(stack_.back());
    stack_.pop_back();
    GmlElement& element = open.element;
    element.line = line();
    if (holds_coordinates(element.name)) read_points(open);
    if (stack_.empty()) return;
    GmlElement& parent = stack_.back().element;
    if (element.name == "Envelope") {
      if (stack_.size() == 2 && parent.name == "boundedBy") give_envelope(element);
      return;
    }
    if (element.name == "lowerCorner" || element.name == "upperCorner") {
      if (!element.positions.empty()) parent.positions.push_back(element.positions.front());
      return;
    }
    // CityModel / cityObjectMember / object
    if (stack_.size() == 2) {
      if (is_one_of(parent.name, {"cityObjectMember", "featureMember", "featureMembers", "member"}))
        ended_ = !sink_.member(std::move(element));
      return;
    }
    if (stack_.size() < 2) return;
    hand_up(std::move(element), parent);
  }

  static void hand_up(GmlElement element, GmlElement& parent) {
    // All from the numbers up to the ring pass their points to their parent.
    if (is_one_of(element.name, {"posList", "pos", "coordinates", "coord", "pointProperty", "LineString",
                                 "Curve", "LineStringSegment", "segments", "curveMember"})) {
      append(parent.positions, element.positions);
    } else if (element.name == "LinearRing" || element.name == "Ring") {
      const bool whole = std::all_of(element.positions.begin(), element.positions.end(),
                                     [](const Eigen::Vector3d& p) { return p.allFinite(); });
      if (!whole) element.positions.clear();
      parent.rings.push_back(std::move(element.positions));
    } else if (!element.rings.empty() && (is_one_of(element.name, {"exterior", "outerBoundaryIs"}))) {
      // The children of a polygon: its rings, the exterior first. Children of a solid have surfaces.
      parent.rings.insert(parent.rings.begin(), std::make_move_iterator(element.rings.begin()),
                          std::make_move_iterator(element.rings.end()));
    } else if (!element.rings.empty() && is_one_of(element.name, {"interior", "innerBoundaryIs"})) {
      if (parent.rings.empty()) parent.rings.emplace_back();  // a polygon without an exterior stays empty
      parent.rings.insert(parent.rings.end(), std::make_move_iterator(element.rings.begin()),
                          std::make_move_iterator(element.rings.end()));
    } else {
      if (is_one_of(element.name, {"Polygon", "PolygonPatch", "Triangle", "Rectangle"})) {
        element.children.clear();
        element.children.shrink_to_fit();
        if (element.rings.empty() && element.href.empty()) element.rings.emplace_back();
      }
      const bool blank = trim(element.text).empty();
      if (blank) element.text.clear();
      parent.children.push_back(std::move(element));
    }
  }

  static void append(std::vector<Eigen::Vector3d>& to, std::vector<Eigen::Vector3d>& from) {
    if (to.empty())
      to = std::move(from);
    else
      to.insert(to.end(), from.begin(), from.end());
  }

  void read_points(Open& open) {
    GmlElement& element = open.element;
    std::string& text = element.text;
    int dimension = open.dimension;
    if (element.name == "coordinates") {  // GML 2: "x,y,z x,y,z"
      const std::size_t first = text.find_first_not_of(" \t\r\n");
      const std::size_t end = text.find_first_of(" \t\r\n", first);
      const std::string_view tuple =
          std::string_view(text).substr(first == std::string::npos ? 0 : first, end - first);
      dimension = static_cast<int>(std::count(tuple.begin(), tuple.end(), ',')) + 1;
      std::replace(text.begin(), text.end(), ',', ' ');
    }
    bool damaged = false;
    std::vector<double> numbers;
    for (const std::string_view word : split_blanks(text)) {
      const std::optional<double> value = parse_double(word);
      damaged = damaged || !value;
      numbers.push_back(value.value_or(0));
    }
    if (!damaged && element.name != "posList" && element.name != "coordinates") {
      dimension = static_cast<int>(numbers.size());
      if (dimension != 2 && dimension != 3)
        fail(fmt::format("a point has {} coordinates", dimension), "correct it, or export the file again");
    }
    if (dimension != 2 && dimension != 3) dimension = numbers.size() % 3 == 0 ? 3 : 2;
    const auto step = static_cast<std::size_t>(dimension);
    if (damaged || numbers.size() % step != 0) {
      // The ring that contains it is dropped.
      element.positions.push_back(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
      text.clear();
      return;
    }
    element.positions.reserve(numbers.size() / step);
    for (std::size_t i = 0; i < numbers.size(); i += step)
      element.positions.emplace_back(numbers[i], numbers[i + 1], step == 3 ? numbers[i + 2] : 0);
    text.clear();
  }

  void give_envelope(const GmlElement& element) {
    if (element.positions.size() != 2 || !element.positions[0].allFinite() ||
        !element.positions[1].allFinite())
      return;
    if (!sink_.envelope({element.positions[0], element.positions[1], element.system, element.line}))
      ended_ = true;
  }

  std::filesystem::path file_;
  const GmlSink& sink_;
  std::unique_ptr<std::remove_pointer_t<XML_Parser>, FreeParser> parser_;
  std::vector<Open> stack_;
  std::vector<std::shared_ptr<const std::string>> systems_;
  std::size_t passed_over_ = 0;  ///< open elements inside a skipped element
  std::exception_ptr failure_;
  bool ended_ = false;
};

}  // namespace

const GmlElement* GmlElement::child(std::string_view child_name) const {
  const auto found = std::find_if(children.begin(), children.end(),
                                  [child_name](const GmlElement& e) { return e.name == child_name; });
  return found == children.end() ? nullptr : &*found;
}

ByteReader file_bytes(const std::filesystem::path& path) {
  auto file = std::make_shared<GzipFile>(path);
  return [file, path](char* to, std::size_t size) {
    const std::size_t n = file->read(to, size, 0);
    if (n == 0 && file->cut_short())
      throw InputError(path, 0, "gzip data are damaged or cut short", "fetch the file again");
    return n;
  };
}

void read_gml(const std::filesystem::path& file, const ByteReader& bytes, const GmlSink& sink) {
  GmlParser(file, sink).read(bytes);
}

}  // namespace canyon::buildings
