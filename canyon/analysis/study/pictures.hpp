#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/analysis/study/along.hpp"
#include "canyon/analysis/study/compare.hpp"

namespace canyon::study {

/// Writes along.png and along.svg: median and 95 % along the route with their intervals; returns their names.
std::vector<std::string> write_along_pictures(const std::filesystem::path& folder, const Manifest& manifest,
                                              const GroupComparison& comparison,
                                              const std::vector<std::vector<Stretch>>& along);

/// Writes errors, boxes and availability as PNG and SVG; returns their names.
std::vector<std::string> write_study_pictures(const std::filesystem::path& folder, const Manifest& manifest,
                                              const GroupComparison& comparison);

}  // namespace canyon::study
