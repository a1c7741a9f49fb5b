#pragma once

#include "canyon/base/output_file.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Writes glTF 2.0 binary (Khronos glTF 2.0, section 4.4), Y up as the standard asks (x east, y up, z south):
/// a node for each object about a whole metre near its own middle, so that single precision holds 1 mm and
/// better there. Origin and name stand in the asset's extras. Throws InputError for a city of 4 GiB and more.
/// Does not commit.
void write_glb(OutputFile& file, const City& city);

}  // namespace canyon::city
