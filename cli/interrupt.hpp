#pragma once

#include <atomic>

namespace canyon::cli {

/// From here on Ctrl-C (SIGINT) and SIGTERM set the returned flag instead of ending the program; a second one
/// ends it at once.
[[nodiscard]] const std::atomic<bool>& catch_interrupts();

}  // namespace canyon::cli
