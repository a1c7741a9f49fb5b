#include "python/src/epochs.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/output/epoch_values.hpp"
#include "python/src/arrays.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {

py::dict columns_of(const std::string& name);

namespace {

py::array_t<double> matrix(const Eigen::Matrix3d& m) {
  const Eigen::Matrix3d turned = m.transpose();  // NumPy's rows are Eigen's columns
  return py::array_t<double>({py::ssize_t{3}, py::ssize_t{3}}, turned.data());
}

const output::Format& format_of(const std::filesystem::path& path, const std::string& name) {
  if (!name.empty()) return output::format_named(name);
  std::string known;
  const std::string ending = path.extension().string();
  for (const output::Format& format : output::formats()) {
    const std::filesystem::path file(format.file);
    if (path.filename() == file) return format;
    if (!ending.empty() && ending == file.extension() && ending != ".csv" && ending != ".mavlink")
      return format;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", format.name);
  }
  throw InputError(fmt::format("the name '{}' has no format's ending", path.filename().string()),
                   "give format=; known are " + known);
}

}  // namespace

KeptEpoch::KeptEpoch(simulation::Epoch from, std::shared_ptr<const gnss::NavigationData> its_messages,
                     std::shared_ptr<const propagation::Arrival> paths,
                     std::shared_ptr<const tracking::SignalOptions> its_signal,
                     std::shared_ptr<const void> keeper)
    : epoch(std::move(from)),
      arrival(std::move(paths)),
      messages(std::move(its_messages)),
      signal(std::move(its_signal)),
      owner(std::move(keeper)) {
  epoch.arrival = arrival.get();
  epoch.navigation = messages.get();
  epoch.environment = nullptr;
}

std::shared_ptr<KeptEpoch> KeptEpoch::copy(const simulation::Epoch& source, bool with_paths,
                                           const std::shared_ptr<simulation::Simulation>& simulation) {
  return std::make_shared<KeptEpoch>(
      source, source.arrival->messages,
      with_paths ? std::make_shared<const propagation::Arrival>(*source.arrival) : nullptr,
      std::shared_ptr<const tracking::SignalOptions>(
          simulation, &simulation->scenario().receivers.at(source.receiver).options.signal),
      simulation);
}

void write_epochs(const std::filesystem::path& path, const std::string& format,
                  const output::ReceiverDescription& receiver, const std::vector<EpochPtr>& epochs) {
  const auto encoder = format_of(path, format).make(receiver);
  OutputFile file(path);
  file.write(encoder->begin());
  for (const EpochPtr& epoch : epochs) file.write(encoder->encode(epoch->epoch));
  file.write(encoder->end());
  if (const auto correction = encoder->correction()) file.overwrite(correction->offset, correction->bytes);
  file.commit();
}

void bind_epochs(py::module_& m) {
  using E = KeptEpoch;
  m.def("columns", &columns_of, "table"_a);
  py::class_<KeptEpoch, EpochPtr>(m, "Epoch",
                                  "One receiver at one instant: the truth, and its measurements and fix.")
      .def_property_readonly(
          "time", [](const E& e) { return datetime(e.epoch.observed.time); }, "True instant, UTC.")
      .def_property_readonly(
          "gps_ns", [](const E& e) { return e.epoch.observed.time.nanoseconds(); },
          "Nanoseconds of GPS time since 1980-01-06.")
      .def_property_readonly("receiver", [](const E& e) { return e.epoch.receiver; })
      .def_property_readonly("solved", [](const E& e) { return e.epoch.observed.fix.solved(); })
      .def_property_readonly(
          "status", [](const E& e) { return std::string(output::status_word(e.epoch.observed.fix)); })
      .def_property_readonly(
          "reason",
          [](const E& e) {
            const positioning::Fix& fix = e.epoch.observed.fix;
            return fix.solved() ? std::string() : std::string(output::no_fix_reason(fix, e.epoch.placement));
          },
          "Why there is no fix.")
      .def_property_readonly(
          "truth", [](const E& e) { return degrees_of(e.epoch.truth.position); },
          "(latitude_deg, longitude_deg, height_m) of the antenna.")
      .def_property_readonly(
          "position",
          [](const E& e) -> py::object {
            if (!e.epoch.observed.fix.solved()) return py::none();
            return degrees_of(e.epoch.observed.fix.position);
          },
          "(latitude_deg, longitude_deg, height_m) as the receiver believes; None without a fix.")
      .def_property_readonly("position_ecef_m",
                             [](const E& e) { return array_of(e.epoch.observed.fix.position_ecef); })
      .def_property_readonly("truth_ecef_m", [](const E& e) { return array_of(e.epoch.truth_ecef); })
      .def_property_readonly(
          "error_enu_m", [](const E& e) { return array_of(e.epoch.error_enu_m); },
          "Fix minus truth; NaN without a fix.")
      .def_property_readonly("covariance_enu_m2",
                             [](const E& e) { return matrix(e.epoch.observed.fix.covariance_enu); })
      .def_property_readonly("velocity_enu_mps",
                             [](const E& e) -> py::object {
                               const auto& velocity = e.epoch.observed.fix.velocity_enu_mps;
                               return velocity ? py::object(array_of(*velocity)) : py::none();
                             })
      .def_property_readonly("used", [](const E& e) { return output::used_count(e.epoch.observed.fix); })
      .def_property_readonly("visible", [](const E& e) { return e.epoch.observed.visible; })
      .def_property_readonly("blocked", [](const E& e) { return e.epoch.observed.blocked; })
      .def_property_readonly(
          "placement", [](const E& e) { return std::string(output::placement_word(e.epoch.placement)); })
      .def_property_readonly("faults", [](const E& e) { return e.epoch.faults; })
      .def(
          "table", [](const EpochPtr& e, const std::string& name) { return table_of({e}, name); }, "name"_a,
          "Columns of this epoch alone: \"epochs\", \"satellites\", \"signals\", \"paths\".");
  py::class_<EpochEncoder>(m, "Encoder", "Makes bytes of epochs, as `canyon simulate` writes them.")
      .def("begin", &EpochEncoder::begin)
      .def("encode", &EpochEncoder::encode, "epoch"_a)
      .def("end", &EpochEncoder::end);
}

}  // namespace canyon::python
