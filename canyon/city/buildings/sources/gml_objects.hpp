#pragma once

#include <set>
#include <string>
#include <string_view>
#include <unordered_map>

#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/gml_document.hpp"

namespace canyon::buildings {

/// Geometries of a document by their ids, for references from other objects.
using GmlLibrary = std::unordered_map<std::string, GmlElement>;

/// Whether read_gml_object() reads or counts an element of that name.
[[nodiscard]] bool is_gml_object(std::string_view name);

/// The ids that an object references and that neither the object nor `library` has.
[[nodiscard]] std::set<std::string> missing_references(const GmlElement& object, const GmlLibrary& library);

/// Adds an object of CityGML and its nested objects (parts, installations, reliefs) to a model, each with the
/// geometry of its best level of detail. Unresolved references are counted.
void read_gml_object(const GmlElement& object, const GmlLibrary& library, CityModel& model);

/// Whether the coordinates of an object's faces are right-handed in the file's order, as for east, north, up:
/// roofs face up, grounds face down and solids have a positive volume. 1: right-handed; -1: left-handed
/// (north, east, up); 0: undetermined.
[[nodiscard]] int handedness(const GmlElement& object);

}  // namespace canyon::buildings
