#pragma once

#include <cairo.h>

#include <new>
#include <string>

namespace canyon::drawing {

/// A cairo_write_func_t that appends to the std::string `target`. Called from C: nothing may be thrown
/// through it.
inline cairo_status_t append_bytes(void* target, const unsigned char* bytes, unsigned length) {
  try {
    static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(bytes), length);
  } catch (const std::bad_alloc&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace canyon::drawing
