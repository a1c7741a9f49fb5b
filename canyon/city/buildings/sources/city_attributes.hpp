#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace canyon::buildings {

/// The names and values of a city model's objects, by the names that the file gives them.
using CityAttributes = std::map<std::string, std::string>;

/// Whether add_tags_of_attributes() looks at an attribute of that name.
[[nodiscard]] bool attribute_matters(std::string_view name);

/// A value of an attribute, a length in metres; other attributes as they are. Nothing for a length in a unit
/// that is not known.
/// @param unit as files name it ("ft", "#m", "urn:ogc:def:uom:EPSG::9002", "[ft_i]"); metres where it is
/// empty
[[nodiscard]] std::optional<std::string> value_in_metres(std::string_view name, std::string_view value,
                                                         std::string_view unit);
/// Such values, for CityModel::leave_out().
inline constexpr const char* kOtherUnit = "attributes in units of length that are not known";

/// Adds the tags of OpenStreetMap that the attributes of CityGML, CityJSON and of common extensions stand
/// for, where these tags are not there yet: `height`, `building:levels`, `building:material`,
/// `roof:material`, `start_date`, `diameter_crown`, and `building:structure` ("wood", "masonry", "concrete",
/// "steel") of PLATEAU's structure codes. Values that stand for "not known" (-9999, year 0001) are left out.
void add_tags_of_attributes(CityAttributes& tags);

/// Whether attributes say that a building is torn down or was never built: a year of demolition, an end of
/// its life, or such a status of the Dutch register of buildings. 9999 stands for none.
[[nodiscard]] bool is_gone(const CityAttributes& attributes);

/// The value of the tag `building` for a building with these attributes, by its function, usage and class:
/// the codes of AdV ("31001_2020", four digits), of PLATEAU (three digits), or a word. "yes" where none is
/// known.
[[nodiscard]] std::string building_use(const CityAttributes& attributes);

}  // namespace canyon::buildings
