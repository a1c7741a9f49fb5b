#pragma once

namespace canyon::options {
/// visitor.hpp; headers of options need no more than its name.
class Visitor;
}  // namespace canyon::options
