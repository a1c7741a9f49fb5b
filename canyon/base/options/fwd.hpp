#pragma once

namespace canyon::options {
/// Forward declaration of visitor.hpp, sufficient for headers of options.
class Visitor;
struct Field;
struct Range;
struct Key;
struct Description;
}  // namespace canyon::options
