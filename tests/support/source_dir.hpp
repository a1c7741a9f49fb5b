#pragma once

/// Root of the checkout, and folder of the build. Not macros, so that object files of two checkouts are equal
/// and share a compiler cache.
extern const char* const canyon_source_dir;
extern const char* const canyon_build_dir;
