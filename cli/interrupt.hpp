#pragma once

#include <atomic>

namespace canyon::cli {

/// Ctrl-C: thrown by callbacks, so that nothing half done is written.
struct Interrupted {};

/// From here on Ctrl-C (SIGINT) and SIGTERM set the returned flag instead of ending the program; a second one
/// ends it at once.
[[nodiscard]] const std::atomic<bool>& catch_interrupts();

}  // namespace canyon::cli
