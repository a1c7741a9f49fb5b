#pragma once

#include <set>
#include <string>
#include <string_view>
#include <unordered_map>

#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/gml_document.hpp"

namespace canyon::buildings {

/// Geometries of a document by their ids, for references to them from elsewhere.
using GmlLibrary = std::unordered_map<std::string, GmlElement>;

/// Whether an element of that name is an object that read_gml_object() makes something of, or counts.
[[nodiscard]] bool is_gml_object(std::string_view name);

/// The ids that references of an object lead to and that neither the object nor `library` has.
[[nodiscard]] std::set<std::string> missing_references(const GmlElement& object, const GmlLibrary& library);

/// Adds an object of CityGML and the objects in it (parts, installations, reliefs) to a model, each with the
/// geometry of its best level of detail. References that lead nowhere are counted.
void read_gml_object(const GmlElement& object, const GmlLibrary& library, CityModel& model);

/// Whether the coordinates of an object's faces are right-handed in the order that the file has them, which
/// is that of east, north, up: its roofs look up and its grounds down then, and its solids have a positive
/// volume. 1: they are; -1: they are left-handed (north, east, up); 0: it does not tell.
[[nodiscard]] int handedness(const GmlElement& object);

}  // namespace canyon::buildings
