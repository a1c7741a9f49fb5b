#include "canyon/simulation/samples/sample_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/simulation/samples/spreading_codes.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::samples {
namespace {

/// GLONASS uses these channels (ICD L1, L2 5.1, table 3.1).
constexpr int kLowestChannel = -7, kHighestChannel = 6;

}  // namespace

BandPlan plan_band(const FrontEnd& front_end, std::span<const gnss::SatelliteId> satellites) {
  BandPlan plan;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      const bool sent = std::any_of(satellites.begin(), satellites.end(), [&](gnss::SatelliteId id) {
        return id.system == system && !components(id, signal).empty();
      });
      if (!sent) continue;
      const std::string name = fmt::format("{} {}", gnss::name(system), signal.name);
      int carried = 0, within = 0, channels = 0;
      const bool many = signal.channel_hz > 0;
      for (int channel = many ? kLowestChannel : 0; channel <= (many ? kHighestChannel : 0); ++channel) {
        const double carrier_hz = signal.carrier_hz + channel * signal.channel_hz;
        ++channels;
        if (carries(front_end, signal, carrier_hz))
          ++carried;
        else if (carrier_hz > front_end.lowest_hz() && carrier_hz < front_end.highest_hz())
          ++within;
      }
      if (carried == channels)
        plan.carried.push_back(name);
      else if (carried > 0)
        plan.carried.push_back(fmt::format("{} ({} of {} channels)", name, carried, channels));
      else if (within > 0)
        plan.left_out.push_back(name);
    }
  }
  return plan;
}

Generator make_generator(const simulation::Simulation& simulation, std::size_t receiver,
                         const FrontEnd& front_end, int threads) {
  const std::vector<simulation::ReceiverConfig>& receivers = simulation.scenario().receivers;
  if (receiver >= receivers.size())
    throw InputError(fmt::format("the scenario has no receiver {}", receiver));
  return {receivers[receiver].options, simulation.scenario().seed, simulation.environment().klobuchar(),
          front_end, threads};
}

BandPlan plan_run(const simulation::Simulation& simulation, const FrontEnd& front_end) {
  front_end.validate();
  if (simulation.epoch_count() < 2) {
    throw InputError("the run has one epoch, but samples need two", "make it longer, or increase rate_hz");
  }
  if (simulation.navigation().empty()) {
    throw InputError("the sky has no broadcast messages for its signals",
                     "use a sky of navigation files, or a nominal one");
  }
  BandPlan plan = plan_band(front_end, simulation.environment().sky().satellites());
  if (plan.carried.empty()) {
    throw InputError(
        fmt::format(
            "{:.3f} Msps, {:.3f} to {:.3f} MHz, carry no signal of the sky{}", front_end.rate_hz * 1e-6,
            front_end.lowest_hz() * 1e-6, front_end.highest_hz() * 1e-6,
            plan.left_out.empty() ? "" : fmt::format("; too narrow for {}", fmt::join(plan.left_out, ", "))),
        plan.left_out.empty()        ? "choose another band"
        : front_end.bandwidth_hz > 0 ? "give the filter a wider band"
        : front_end.real ? fmt::format("choose a higher sample rate, with the intermediate frequency at a "
                                       "quarter of it: now {} Hz",
                                       front_end.rate_hz / 4)
                         : "choose a higher sample rate, and leave the carrier in the middle");
  }
  return plan;
}

FrontEnd front_end(const SampleOptions& samples, const std::string& band) {
  samples.validate();
  return {band_centre_hz(band), samples.intermediate_hz, samples.rate_hz,
          samples.real,         samples.bandwidth_hz,    samples.noise};
}

SampleFile::SampleFile(const simulation::Simulation& simulation, SampleFileOptions options)
    : simulation_(simulation),
      options_(std::move(options)),
      front_end_(samples::front_end(options_.samples, options_.band)),
      plan_(plan_run(simulation, front_end_)),
      generator_(make_generator(simulation, options_.receiver, front_end_, options_.threads)),
      encoder_(options_.samples.format, front_end_.real) {
  // The 2 bit threshold, 2 of 3, is optimal at one deviation (0.996 of it: J. Max, IRE Trans. IT-6, 1960).
  const double level =
      options_.samples.noise_level.value_or(options_.samples.format == Format::TwoBit ? 2.0 / 3 : 0.25);
  gain_ = static_cast<float>(level * largest(options_.samples.format));
  std::error_code error;
  if (options_.to) return;
  const bool to_output = options_.path == "-";
  if (to_output || std::filesystem::is_fifo(options_.path, error)) {
    pipe_ = to_output ? ::fdopen(::dup(STDOUT_FILENO), "wb") : std::fopen(options_.path.c_str(), "wb");
    if (pipe_ == nullptr)
      throw OutputError(options_.path.string(), 0, "cannot be opened", "check its permissions");
  } else {
    InputFiles::current().refuse(meta_path());
    file_.emplace(options_.path);
    const auto space = std::filesystem::space(std::filesystem::absolute(options_.path).parent_path(), error);
    if (!error && space.available < expected_bytes()) {
      throw OutputError(options_.path.string(), 0,
                        fmt::format("the samples need {:.2f} GB, but {:.2f} GB are free",
                                    static_cast<double>(expected_bytes()) * 1e-9,
                                    static_cast<double>(space.available) * 1e-9),
                        "free disk space, shorten the run, or reduce the rate");
    }
  }
}

SampleFile::~SampleFile() {
  if (pipe_ != nullptr) std::fclose(pipe_);
}

std::uintmax_t SampleFile::expected_bytes() const {
  const double seconds = static_cast<double>(simulation_.epoch_count() - 1) * simulation_.interval_s();
  const auto samples = static_cast<std::uintmax_t>(std::llround(seconds * front_end_.rate_hz));
  return (samples * (front_end_.real ? 1 : 2) * bits(options_.samples.format) + 7) / 8;
}

void SampleFile::write(const simulation::Epoch& epoch) {
  if (epoch.receiver != options_.receiver) return;
  if (!position_) position_ = epoch.truth.position;
  clipped_ = epoch_fix_ = 0;
  generator_.next(epoch, [this](const SampleBlock& block, std::size_t samples) { put(block, samples); });
  if (epoch_fix_ > 0)
    max_clipped_ = std::max(max_clipped_, static_cast<double>(clipped_) / static_cast<double>(epoch_fix_));
}

void SampleFile::put(const SampleBlock& block, std::size_t samples) {
  if (!packed(options_.samples.format)) {
    const auto limit = static_cast<float>(largest(options_.samples.format)) / gain_;
    for (std::size_t n = 0; n < samples; ++n) {
      clipped_ += std::abs(block.re[n]) > limit ? 1U : 0U;
      clipped_ += !front_end_.real && std::abs(block.im[n]) > limit ? 1U : 0U;
    }
    epoch_fix_ += (front_end_.real ? 1 : 2) * samples;
  }
  encoder_.encode(block, samples, gain_, bytes_);
  put_bytes(bytes_);
  samples_ += samples;
}

void SampleFile::put_bytes(std::string_view bytes) {
  if (file_)
    file_->write(bytes);
  else if (options_.to)
    options_.to->write(bytes);
  else if (std::fwrite(bytes.data(), 1, bytes.size(), pipe_) != bytes.size() ||
           (bytes.empty() && std::fflush(pipe_) != 0))
    throw OutputError(options_.path.string(), 0, "the reader is gone", "start it again");
}

std::string SampleFile::metadata() const {
  const std::string& receiver = simulation_.scenario().receivers[options_.receiver].options.name;
  Json global = Json::object();
  global["core:datatype"] = sigmf_type(options_.samples.format, front_end_.real);
  global["core:sample_rate"] = front_end_.rate_hz;
  global["core:version"] = "1.2.0";
  global["core:num_channels"] = 1;
  std::string description = fmt::format("Simulated; no signal was received. Receiver '{}': {}", receiver,
                                        fmt::join(plan_.carried, ", "));
  if (front_end_.bandwidth_hz > 0)
    description += fmt::format(". Filtered: {} MHz", front_end_.bandwidth_hz * 1e-6);
  if (packed(options_.samples.format)) {
    // A reader without these fields would read bytes as samples: the extension is not optional.
    Json extension = Json::object();
    extension["name"] = "canyon";
    extension["version"] = "1.0.0";
    extension["optional"] = false;
    global["core:extensions"] = Json::array();
    global["core:extensions"].push_back(std::move(extension));
    global["canyon:bits"] = bits(options_.samples.format);
    global["canyon:parts"] = front_end_.real ? 1 : 2;
    description += fmt::format(
        ". {} bit{} a part, {}, from the lowest bits of each byte on; {}", bits(options_.samples.format),
        bits(options_.samples.format) == 1 ? "" : "s",
        front_end_.real ? "one part a sample" : "real and imaginary part in turn",
        options_.samples.format == Format::OneBit ? "0: 1, 1: -1" : "00: 1, 01: 3, 10: -3, 11: -1");
  }
  global["core:description"] = std::move(description);
  global["core:recorder"] = "Canyon";
  global["core:hw"] = "none";
  // SigMF's standard name need not be given.
  if (options_.path.extension() != ".sigmf-data") global["core:dataset"] = options_.path.filename().string();
  Json capture = Json::object();
  capture["core:sample_start"] = 0;
  capture["core:frequency"] = front_end_.zero_hz();
  if (samples_ > 0) capture["core:datetime"] = geodesy::format_utc(generator_.begin(), 9);
  if (position_) {
    Json point = Json::object();
    point["type"] = "Point";
    point["coordinates"] = Json{geodesy::degrees(position_->longitude_rad),
                                geodesy::degrees(position_->latitude_rad), position_->height_m};
    capture["core:geolocation"] = std::move(point);
  }
  Json meta = Json::object();
  meta["global"] = std::move(global);
  meta["captures"] = Json::array();
  meta["captures"].push_back(std::move(capture));
  meta["annotations"] = Json::array();
  return meta.dump(2) + "\n";
}

void SampleFile::finish() {
  encoder_.finish(bytes_);
  if (!bytes_.empty()) put_bytes(bytes_);
  if (options_.to) return options_.to->finish();
  if (!file_) return put_bytes({});
  file_->commit();
  write_file(meta_path(), metadata());
}

std::string SampleFile::about() const {
  const FrontEnd& f = front_end_;
  return fmt::format("{}: {:.3f} MHz{}, {} Msps {}{}, {:.3f} GB: {}", options_.path.string(),
                     f.centre_hz * 1e-6,
                     f.intermediate_hz != 0 ? fmt::format(" at {} MHz", f.intermediate_hz * 1e-6) : "",
                     f.rate_hz * 1e-6, f.real ? "real " : "", name(options_.samples.format),
                     static_cast<double>(expected_bytes()) * 1e-9, fmt::join(plan_.carried, ", "));
}

std::vector<std::string> SampleFile::warnings() const {
  std::vector<std::string> warnings;
  if (!plan_.left_out.empty()) {
    warnings.push_back(fmt::format("{}: left out, too wide for {} Msps: {}", options_.path.string(),
                                   front_end_.rate_hz * 1e-6, fmt::join(plan_.left_out, ", ")));
  }
  if (const auto contents = generator_.contents(); !contents.without_message.empty()) {
    warnings.push_back(fmt::format("{}: without symbols, since their messages are unknown: {}",
                                   options_.path.string(), fmt::join(contents.without_message, ", ")));
  }
  constexpr double kMuch = 0.01;
  if (max_clipped_ > kMuch) {
    warnings.push_back(fmt::format("{}: up to {:.0f} % of the samples are clipped: reduce noise_level",
                                   options_.path.string(), 100 * max_clipped_));
  }
  return warnings;
}

std::vector<std::unique_ptr<SampleFile>> make_sample_files(const simulation::Simulation& simulation,
                                                           std::size_t receiver,
                                                           const std::filesystem::path& path, int threads,
                                                           const std::shared_ptr<transport::ByteSink>& to) {
  SampleFileOptions options{path, receiver, {}, simulation.scenario().samples, threads, to};
  const std::vector<std::string>& bands = options.samples.bands;
  if (bands.size() > 1 && (path == "-" || to)) {
    throw InputError(
        fmt::format("'{}' can hold one band, but the samples have {}", path.string(), bands.size()),
        "give a file, or one band");
  }
  std::vector<std::unique_ptr<SampleFile>> files;
  for (const std::string& band : bands) {
    if (bands.size() > 1)
      options.path = path.parent_path() / (path.stem().string() + "." + band + path.extension().string());
    options.band = band;
    files.push_back(std::make_unique<SampleFile>(simulation, options));
  }
  return files;
}

namespace {

struct FormatRow {
  std::string_view sigmf;
  std::size_t bits;
  double largest;
};
constexpr FormatRow kFormats[]{
    {"i8", 8, 127}, {"i16_le", 16, 32767}, {"f32_le", 32, 1}, {"u8", 2, 3}, {"u8", 1, 1}};
const FormatRow& row(Format format) {
  return kFormats[static_cast<std::size_t>(format)];
}

unsigned two_bits(float value) {
  constexpr float kThreshold = 2;
  if (value < 0) return value < -kThreshold ? 2 : 3;
  return value > kThreshold ? 1 : 0;
}
unsigned one_bit(float value) {
  return value < 0 ? 1 : 0;
}

}  // namespace

std::size_t bits(Format format) {
  return row(format).bits;
}

double largest(Format format) {
  return row(format).largest;
}

std::string sigmf_type(Format format, bool real) {
  return fmt::format("{}{}", real || packed(format) ? 'r' : 'c', row(format).sigmf);
}

void SampleEncoder::encode(const SampleBlock& block, std::size_t samples, float gain, std::string& bytes) {
  const auto whole = [&](auto of) {
    using Value = decltype(of);
    bytes.resize((real_ ? 1 : 2) * samples * sizeof(Value));
    auto* out = reinterpret_cast<Value*>(bytes.data());
    if (real_)
      quantise(block.re.data(), samples, gain, out);
    else
      quantise(block, samples, gain, out);
  };
  const auto pack = [&](auto code, unsigned size) {
    bytes.clear();
    bytes.reserve(samples * size / 4 + 1);
    const auto put = [&](float value) {
      kept_ |= code(value * gain) << kept_bits_;
      kept_bits_ += size;
      if (kept_bits_ < 8) return;
      bytes.push_back(static_cast<char>(kept_));
      kept_ = kept_bits_ = 0;
    };
    for (std::size_t n = 0; n < samples; ++n) {
      put(block.re[n]);
      if (!real_) put(block.im[n]);
    }
  };
  switch (format_) {
    case Format::Int8:
      return whole(std::int8_t{});
    case Format::Int16:
      return whole(std::int16_t{});
    case Format::Float32:
      return whole(float{});
    case Format::TwoBit:
      return pack(two_bits, 2);
    case Format::OneBit:
      return pack(one_bit, 1);
  }
}

void SampleEncoder::finish(std::string& bytes) {
  bytes.clear();
  if (std::exchange(kept_bits_, 0) > 0) bytes.push_back(static_cast<char>(std::exchange(kept_, 0)));
}

}  // namespace canyon::samples
