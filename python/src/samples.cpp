#include <fmt/format.h>

#include <complex>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/samples/sample_file.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "python/src/binding.hpp"
#include "python/src/stream.hpp"

namespace canyon::python {
namespace {

using simulation::Simulation;
using SimulationPtr = std::shared_ptr<Simulation>;
using SampleVector = std::vector<std::complex<float>>;

/// Passes on samples in pieces of equal size, the last one shorter.
class Pieces final : public simulation::EpochSink {
 public:
  Pieces(const Simulation& simulation, std::size_t receiver, const samples::FrontEnd& front_end, int threads,
         std::size_t size, Stream<SampleVector>::Push push)
      : receiver_(receiver),
        real_(front_end.real),
        generator_(samples::make_generator(simulation, receiver, front_end, threads)),
        size_(size),
        push_(std::move(push)) {}
  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver != receiver_) return;
    generator_.next(epoch, [this](const samples::SampleBlock& block, std::size_t count) {
      for (std::size_t n = 0; n < count; ++n) {
        piece_.emplace_back(block.re[n], real_ ? 0 : block.im[n]);
        if (piece_.size() == size_) enqueue();
      }
    });
  }
  void finish() override {
    if (!piece_.empty()) enqueue();
  }

 private:
  void enqueue() {
    push_(std::exchange(piece_, {}));
    piece_.reserve(size_);
  }
  std::size_t receiver_;
  bool real_;
  samples::Generator generator_;
  std::size_t size_;
  Stream<SampleVector>::Push push_;
  SampleVector piece_;
};

/// complex64, or float32 for real samples.
py::object array_of_samples(SampleVector&& values, bool real) {
  if (!real) return owning_array(std::move(values));
  std::vector<float> parts(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) parts[i] = values[i].real();
  return owning_array(std::move(parts));
}

/// Samples of a run, piece by piece.
class SampleStream {
 public:
  SampleStream(const SimulationPtr& simulation, const std::string& band, std::size_t receiver,
               const samples::SampleOptions& samples, std::size_t size, int threads)
      : real_(samples.real) {
    if (size == 0) throw InputError("blocks of 0 samples never end", "give 1 or more");
    const samples::FrontEnd about = samples::front_end(samples, band);
    (void)samples::plan_run(*simulation, about);
    simulation::RunOptions options;
    options.threads = threads;
    options.block = 16;
    stream_ =
        std::make_unique<Stream<SampleVector>>(simulation, options, 4, [&](Stream<SampleVector>::Push push) {
          return std::make_unique<Pieces>(*simulation, receiver, about, threads, size, std::move(push));
        });
  }
  py::object next() { return array_of_samples(stream_->next(), real_); }
  void close() { stream_->close(); }

 private:
  bool real_;
  std::unique_ptr<Stream<SampleVector>> stream_;
};

}  // namespace

void bind_samples(py::module_& m) {
  py::class_<SampleStream>(m, "SampleStream", "Samples of a run, block by block.")
      .def(py::init([](const SimulationPtr& simulation, const std::optional<std::string>& band,
                       std::optional<double> rate_hz, std::optional<double> intermediate_hz,
                       std::optional<bool> real, std::optional<double> bandwidth_hz,
                       std::optional<bool> noise, std::size_t receiver, std::size_t size, int threads) {
             samples::SampleOptions samples = simulation->scenario().samples;
             if (band) samples.bands = {*band};
             samples.rate_hz = rate_hz.value_or(samples.rate_hz);
             samples.intermediate_hz = intermediate_hz.value_or(samples.intermediate_hz);
             samples.real = real.value_or(samples.real);
             samples.bandwidth_hz = bandwidth_hz.value_or(samples.bandwidth_hz);
             samples.noise = noise.value_or(samples.noise);
             if (samples.bands.size() != 1)
               throw InputError(
                   fmt::format("the scenario's samples have the bands {}", fmt::join(samples.bands, ", ")),
                   "choose one with band");
             return std::make_unique<SampleStream>(simulation, samples.bands.front(), receiver, samples, size,
                                                   threads);
           }),
           "simulation"_a, "band"_a, "rate_hz"_a, "intermediate_hz"_a, "real"_a, "bandwidth_hz"_a, "noise"_a,
           "receiver"_a, "size"_a, "threads"_a)
      .def(
          "__iter__", [](SampleStream& self) -> SampleStream& { return self; },
          py::return_value_policy::reference_internal)
      .def("__next__", &SampleStream::next)
      .def("close", &SampleStream::close);
}

}  // namespace canyon::python
