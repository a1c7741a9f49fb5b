#pragma once

namespace canyon::options {

/// A switch, on or off. If it is not set, the default may depend on other options.
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
  /// Sets the default, used if the switch is not set.
  constexpr void set_default(bool value) {
    if (!set_) value_ = value;
  }
  [[nodiscard]] constexpr bool is_set() const { return set_; }

 private:
  bool value_;
  bool set_ = false;
};

}  // namespace canyon::options
