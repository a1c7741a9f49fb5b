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
#include "canyon/base/transport/byte_sink.hpp"
#include "canyon/simulation/samples/generator.hpp"
#include "canyon/simulation/samples/mixer.hpp"
#include "canyon/simulation/scenario/sample_options.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::samples {

/// Encoding of a part of a sample (real or imaginary); integers and floats in the machine's byte order.
///
/// TwoBit: values -3, -1, 1, 3, with the threshold at 2; the two bits are the two's complement of (value - 1)
/// / 2, so that 00 is 1, 01 is 3, 10 is -3 and 11 is -1, and four values fill a byte from its lowest bits on,
/// as GNSS-SDR's Two_Bit_Packed_File_Signal_Source reads bytes. OneBit: values 1 (bit 0) and -1 (bit 1),
/// eight of them in a byte from its lowest bit on.
using Format = SampleFormat;
/// Bits of a part.
[[nodiscard]] std::size_t bits(Format format);
/// Whether parts of several samples share a byte, for which SigMF has no data type.
[[nodiscard]] inline bool packed(Format format) {
  return bits(format) < 8;
}
/// The largest value of a part; 1 for float32, which has no limit.
[[nodiscard]] double largest(Format format);
/// SigMF's data type; for packed formats that of their bytes.
[[nodiscard]] std::string sigmf_type(Format format, bool real);

/// Writes samples in a format: real and imaginary part alternately, or only the real part.
class SampleEncoder {
 public:
  SampleEncoder(Format format, bool real) : format_(format), real_(real) {}
  /// Encodes the first samples of a block times `gain`, rounded to the nearest value and limited to the
  /// largest one.
  /// @param bytes replaced; values that do not fill a byte are kept for the next call
  void encode(const SampleBlock& block, std::size_t samples, float gain, std::string& bytes);
  /// The remaining bits, padded with zero bits. @param bytes replaced
  void finish(std::string& bytes);

 private:
  Format format_;
  bool real_;
  unsigned kept_ = 0, kept_bits_ = 0;
};

/// Signals of a sky's systems about a front end's centre, by "GPS L1CA".
struct BandPlan {
  std::vector<std::string> carried;   ///< GLONASS: with the number of its carried channels
  std::vector<std::string> left_out;  ///< signals in the band with too little of their power in it
};
[[nodiscard]] BandPlan plan_band(const FrontEnd& front_end, std::span<const gnss::SatelliteId> satellites);

/// Signals of a run's sky that the front end carries. Throws InputError if there is none, if no message
/// describes the sky, and if the run has one epoch.
[[nodiscard]] BandPlan plan_run(const simulation::Simulation& simulation, const FrontEnd& front_end);
/// The generator of a run's receiver. InputError as Generator(), and if there is no such receiver.
[[nodiscard]] Generator make_generator(const simulation::Simulation& simulation, std::size_t receiver,
                                       const FrontEnd& front_end, int threads);

/// The front end of one of its bands. Throws InputError for an unknown band.
[[nodiscard]] FrontEnd front_end(const SampleOptions& samples, const std::string& band);

struct SampleFileOptions {
  /// "-": the standard output; a FIFO is written as it is. With `to`: a name for messages.
  std::filesystem::path path;
  std::size_t receiver = 0;  ///< of the scenario
  std::string band = "L1";   ///< of front_end()
  SampleOptions samples;
  int threads = 0;                               ///< 0: as many as cores
  std::shared_ptr<transport::ByteSink> to = {};  ///< instead of a file
};

/// Writes the samples of one receiver, and next to them their metadata as SigMF 1.2 (NAME.sigmf-meta). Both
/// are complete or absent; an interrupted run leaves the samples written so far.
class SampleFile final : public simulation::EpochSink {
 public:
  /// Throws InputError for options out of range and as plan_run() does; OutputError if the disk has less free
  /// space than expected_bytes().
  SampleFile(const simulation::Simulation& simulation, SampleFileOptions options);
  ~SampleFile() override;

  /// Size for the whole run.
  [[nodiscard]] std::uintmax_t expected_bytes() const;
  [[nodiscard]] std::uintmax_t samples() const { return samples_; }
  [[nodiscard]] Generator::Contents contents() const { return generator_.contents(); }
  /// "drive.iq: 1575.420 MHz, 4 Msps int8, 0.960 GB: GPS L1CA, Galileo E1".
  [[nodiscard]] std::string about() const;
  /// Signals that are too wide for the samples, satellites without a message, and clipped samples.
  [[nodiscard]] std::vector<std::string> warnings() const override;

  void write(const simulation::Epoch& epoch) override;
  void finish() override;

 private:
  void put(const SampleBlock& block, std::size_t samples);
  void put_bytes(std::string_view bytes);
  [[nodiscard]] std::string metadata() const;
  [[nodiscard]] std::filesystem::path meta_path() const {
    return std::filesystem::path(options_.path).replace_extension(".sigmf-meta");
  }

  const simulation::Simulation& simulation_;
  SampleFileOptions options_;
  FrontEnd front_end_;
  BandPlan plan_;
  Generator generator_;
  SampleEncoder encoder_;
  float gain_ = 1;
  std::optional<OutputFile> file_;
  std::FILE* pipe_ = nullptr;
  std::string bytes_;
  std::uintmax_t samples_ = 0;
  std::size_t clipped_ = 0, epoch_fix_ = 0;
  double max_clipped_ = 0;  ///< clipped fraction of the parts of an epoch, maximum
  std::optional<geodesy::Geodetic> position_;
};

/// One file for each band of the scenario's `samples:`: `path`, or for several bands its stem and the band
/// ("drive.L5.iq"). Throws InputError as SampleFile() does, and if several bands share `to` or "-".
/// @param to instead of a file; `path` is then a name for messages
[[nodiscard]] std::vector<std::unique_ptr<SampleFile>> make_sample_files(
    const simulation::Simulation& simulation, std::size_t receiver, const std::filesystem::path& path,
    int threads = 0, const std::shared_ptr<transport::ByteSink>& to = {});

}  // namespace canyon::samples
