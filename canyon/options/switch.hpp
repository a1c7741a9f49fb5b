#pragma once

#include "canyon/options/visitor.hpp"

namespace canyon::options {

/// A switch, on or off. Where nobody sets it, the default may depend on other options.
class Switch {
 public:
  /// A default.
  constexpr Switch(bool value) : value_(value) {}     // NOLINT(google-explicit-constructor): it is a bool
  constexpr operator bool() const { return value_; }  // NOLINT(google-explicit-constructor)
  constexpr Switch& operator=(bool value) {
    value_ = value;
    set_ = true;
    return *this;
  }
  /// Sets the value that holds where nobody sets it.
  constexpr void set_default(bool value) {
    if (!set_) value_ = value;
  }
  [[nodiscard]] constexpr bool is_set() const { return set_; }

 private:
  bool value_;
  bool set_ = false;
};

inline void visit_switch(Visitor& v, const Field& field, Switch& value) {
  if (v.leaves_out_defaults() && !value.is_set()) return;
  bool on = value;
  v.boolean(field, on);
  if (v.reads() && v.has(field.name)) value = on;
}

}  // namespace canyon::options
