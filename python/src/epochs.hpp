#pragma once

#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/simulation/simulator.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// An epoch stored in Python. Data that is valid only during a call is copied or kept alive here.
struct KeptEpoch {
  simulation::Epoch epoch;
  std::shared_ptr<const propagation::Arrival> arrival;  ///< null if paths were not requested
  std::shared_ptr<const gnss::NavigationData> messages;
  std::shared_ptr<const tracking::SignalOptions> signal;  ///< of its receiver
  std::shared_ptr<const void> owner;  ///< of the objects that messages refer to: simulation, live receiver

  /// @param paths also stored, some kilobytes; may be null
  KeptEpoch(simulation::Epoch from, std::shared_ptr<const gnss::NavigationData> its_messages,
            std::shared_ptr<const propagation::Arrival> paths,
            std::shared_ptr<const tracking::SignalOptions> its_signal, std::shared_ptr<const void> keeper);
  /// A copy of an epoch received by a sink.
  static std::shared_ptr<KeptEpoch> copy(const simulation::Epoch& source, bool with_paths,
                                         const std::shared_ptr<simulation::Simulation>& simulation);
};
using EpochPtr = std::shared_ptr<KeptEpoch>;

/// A table of epochs by its name: "epochs", "satellites", "signals", "paths": column name to array.
[[nodiscard]] py::dict table_of(const std::vector<EpochPtr>& epochs, const std::string& name);

/// Encodes epochs of one receiver, as in `canyon simulate`.
class EpochEncoder {
 public:
  EpochEncoder(const std::string& format, const encoding::ReceiverDescription& receiver)
      : encoder_(encoding::format_named(format).make(receiver)) {}
  [[nodiscard]] py::bytes begin() { return encoder_->begin(); }
  [[nodiscard]] py::bytes encode(const KeptEpoch& epoch) { return encoder_->encode(epoch.epoch); }
  [[nodiscard]] py::bytes end() {
    std::string bytes;
    encoder_->end([&](std::string_view more) { bytes += more; });
    return bytes;
  }

 private:
  std::unique_ptr<encoding::Encoder> encoder_;
};

/// Writes all epochs into one file, complete or absent. @param format empty: by the file's name
void write_epochs(const std::filesystem::path& path, const std::string& format,
                  const encoding::ReceiverDescription& receiver, const std::vector<EpochPtr>& epochs);

}  // namespace canyon::python
