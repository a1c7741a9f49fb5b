#pragma once

/// Root of the checkout. Not a macro: object files of two checkouts are the same, so that a compiler cache
/// serves both.
extern const char* const canyon_source_dir;
