#pragma once

/// Root of the checkout, and folder of the build. Not macros: object files of two checkouts are the same, so
/// that a compiler cache serves both.
extern const char* const canyon_source_dir;
extern const char* const canyon_build_dir;
