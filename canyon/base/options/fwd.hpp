#pragma once

namespace canyon::options {
/// Forward declaration of visitor.hpp, sufficient for headers of options.
class Visitor;
}  // namespace canyon::options
