#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/samples/generator.hpp"
#include "canyon/samples/sample_format.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/transport/byte_stream.hpp"

namespace canyon::samples {

/// The carrier [Hz] of a band: "L1", "L2", "L5", "E5", or the name of a signal (E1, E5a, B1I, G1, ...).
/// InputError for another name.
[[nodiscard]] double band_centre_hz(std::string_view band);

/// Signals of a sky's systems about a front end's centre, by "GPS L1CA".
struct BandPlan {
  std::vector<std::string> carried;   ///< GLONASS: with the number of its channels that are
  std::vector<std::string> left_out;  ///< their carrier lies within the band, and too little of their power
};
[[nodiscard]] BandPlan plan_band(const FrontEnd& front_end, std::span<const gnss::SatelliteId> satellites);

/// What the front end carries of a run's sky. Throws InputError where that is nothing, where no message
/// describes the sky, and where the run has one epoch.
[[nodiscard]] BandPlan plan_run(const simulation::Simulation& simulation, const FrontEnd& front_end);
/// The generator of a run's receiver. Throws InputError as Generator() does, and where there is no such
/// receiver.
[[nodiscard]] Generator make_generator(const simulation::Simulation& simulation, std::size_t receiver,
                                       const FrontEnd& front_end, int threads);

/// What a file of samples is.
struct SampleFileOptions {
  /// "-": the standard output; a FIFO is written as it is; an address of transport::ByteStream.
  std::filesystem::path path;
  std::size_t receiver = 0;  ///< of the scenario
  FrontEnd front_end;
  Format format = Format::Int8;
  /// Standard deviation of the noise in each part over the largest value [1], (0, 1]; for float32 over 1.
  /// Empty: 0.25; 0.67 of 2 bits, where the threshold is then one deviation. 1 bit takes none.
  std::optional<double> noise_level;
  /// Time constant [s] of a gain control, {0} or [0.001, 100]; 0: none. It brings the deviation of all that
  /// is received, jammers included, to the noise level: the gain of a block of a millisecond is that level
  /// over the root of the mean power so far, which forgets exponentially.
  double agc_s = 0;
  int threads = 0;  ///< 0: as many as cores
};

/// Writes the samples of one receiver, and beside them what they are, as SigMF 1.2 (NAME.sigmf-meta). Both
/// are whole or absent; an interrupted run leaves what was made.
class SampleFile final : public simulation::EpochSink {
 public:
  /// Throws InputError for options out of range and where plan_run() does; OutputError where the disk has
  /// less room than expected_bytes().
  SampleFile(const simulation::Simulation& simulation, SampleFileOptions options);
  ~SampleFile() override;

  /// Of the whole run.
  [[nodiscard]] std::uintmax_t expected_bytes() const;
  /// Of an address: until somebody reads. Others return at once.
  void wait_for_reader();
  [[nodiscard]] std::uintmax_t samples() const { return samples_; }
  [[nodiscard]] const BandPlan& plan() const { return plan_; }
  [[nodiscard]] Generator::Contents contents() const { return generator_.contents(); }
  /// Largest share of the parts [1] that was beyond the largest value, of an epoch.
  [[nodiscard]] double most_clipped() const { return most_clipped_; }

  void write(const simulation::Epoch& epoch) override;
  void finish() override;

 private:
  void put(const Block& block, std::size_t samples);
  void control_gain(const Block& block, std::size_t samples);
  void put_bytes(std::string_view bytes);
  [[nodiscard]] std::string metadata() const;

  const simulation::Simulation& simulation_;
  SampleFileOptions options_;
  BandPlan plan_;
  Generator generator_;
  Encoder encoder_;
  double level_ = 1;  ///< wanted deviation of a part
  float gain_ = 1;
  std::optional<double> power_;  ///< of a part, that the gain control has found
  std::optional<OutputFile> file_;
  std::FILE* pipe_ = nullptr;
  bool owns_pipe_ = false;
  std::optional<transport::ByteStream> stream_;
  std::string bytes_;
  std::uintmax_t samples_ = 0;
  std::size_t clipped_ = 0, of_epoch_ = 0;
  double most_clipped_ = 0;
  std::optional<geodesy::Geodetic> place_;
};

}  // namespace canyon::samples
