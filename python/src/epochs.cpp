#include "python/src/epochs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/outputs/encoding/columns.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/simulation/simulator.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {

py::dict columns_of(const std::string& name);

namespace {

py::array_t<double> matrix(const Eigen::Matrix3d& m) {
  const Eigen::Matrix3d rotated = m.transpose();  // NumPy's rows are Eigen's columns
  return read_only(py::array_t<double>({py::ssize_t{3}, py::ssize_t{3}}, rotated.data()));
}

const encoding::Format& format_of(const std::filesystem::path& path, const std::string& name) {
  if (!name.empty()) return encoding::format_named(name);
  std::string known;
  const std::string ending = path.extension().string();
  for (const encoding::Format& format : encoding::formats()) {
    const std::filesystem::path file(format.file);
    if (path.filename() == file) return format;
    if (!ending.empty() && ending == file.extension() && ending != ".csv" && ending != ".mavlink")
      return format;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", format.name);
  }
  throw InputError(fmt::format("the name '{}' has no known format extension", path.filename().string()),
                   "give format=, one of " + known);
}

using encoding::Column;
using encoding::Row;

const encoding::Table& table_named(const std::string& name) {
  std::vector<std::string_view> known;
  for (const encoding::Table& table : encoding::tables()) {
    if (table.name == name) return table;
    known.push_back(table.name);
  }
  throw InputError(fmt::format("there is no table '{}'", name),
                   fmt::format("use one of {}", fmt::join(known, ", ")));
}

/// Texts with few different values become a fixed-width array of UTF-32, as in NumPy.
py::object texts(const std::vector<std::string>& all) {
  std::size_t width = 1;
  for (const std::string& text : all) width = std::max(width, text.size());
  py::array array(py::dtype(fmt::format("U{}", width)),
                  std::vector<py::ssize_t>{static_cast<py::ssize_t>(all.size())});
  auto* out = static_cast<char32_t*>(array.mutable_data());
  std::fill(out, out + all.size() * width, U'\0');
  for (std::size_t i = 0; i < all.size(); ++i) {
    // Only fault names may have non-ASCII letters.
    const py::str decoded(all[i]);
    const py::ssize_t length = PyUnicode_GetLength(decoded.ptr());
    for (py::ssize_t k = 0; k < length; ++k) {
      out[i * width + static_cast<std::size_t>(k)] =
          static_cast<char32_t>(PyUnicode_ReadChar(decoded.ptr(), k));
    }
  }
  return array;
}

/// The values of one column, row by row.
class Values {
 public:
  explicit Values(const Column& column) : column_(column) {}

  void add(const Row& row) {
    switch (column_.kind) {
      case Column::Kind::Number:
      case Column::Kind::Seconds:
        return numbers_.push_back(column_.value(row));
      case Column::Kind::Integer:
        return integers_.push_back(column_.integer(row));
      case Column::Kind::Word: {
        const std::int64_t index = column_.integer(row);
        return void(texts_.emplace_back(index < 0 ? std::string_view() : column_.word(index)));
      }
      case Column::Kind::Text:
        return texts_.push_back(column_.text(row));
    }
  }
  [[nodiscard]] py::object array() && {
    switch (column_.kind) {
      case Column::Kind::Number:
      case Column::Kind::Seconds:
        return owning_array(std::move(numbers_));
      case Column::Kind::Integer:
        return owning_array(std::move(integers_));
      case Column::Kind::Word:
      case Column::Kind::Text:
        break;
    }
    return texts(texts_);
  }
  [[nodiscard]] const Column& column() const { return column_; }

 private:
  const Column& column_;
  std::vector<double> numbers_;
  std::vector<std::int64_t> integers_;
  std::vector<std::string> texts_;
};

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
                  const encoding::ReceiverDescription& receiver, const std::vector<EpochPtr>& epochs) {
  const auto encoder = format_of(path, format).make(receiver);
  OutputFile file(path);
  file.write(encoder->begin());
  for (const EpochPtr& epoch : epochs) file.write(encoder->encode(epoch->epoch));
  encoder->end([&](std::string_view bytes) { file.write(bytes); });
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
          "status", [](const E& e) { return std::string(encoding::status_word(e.epoch.observed.fix)); })
      .def_property_readonly(
          "reason",
          [](const E& e) {
            const positioning::Fix& fix = e.epoch.observed.fix;
            return fix.solved() ? std::string()
                                : std::string(encoding::no_fix_reason(fix, e.epoch.containment));
          },
          "Reason why there is no fix.")
      .def_property_readonly(
          "truth", [](const E& e) { return degrees_of(e.epoch.truth.position); },
          "(latitude_deg, longitude_deg, height_m) of the antenna.")
      .def_property_readonly(
          "position",
          [](const E& e) -> py::object {
            if (!e.epoch.observed.fix.solved()) return py::none();
            return degrees_of(e.epoch.observed.fix.position);
          },
          "(latitude_deg, longitude_deg, height_m) of the fix; None without a fix.")
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
      .def_property_readonly("used", [](const E& e) { return encoding::used_count(e.epoch.observed.fix); })
      .def_property_readonly("tracked", [](const E& e) { return e.epoch.observed.visible; })
      .def_property_readonly("not_tracked", [](const E& e) { return e.epoch.observed.blocked; })
      .def_property_readonly(
          "placement",
          [](const E& e) { return std::string(encoding::containment_word(e.epoch.containment)); })
      .def_property_readonly("faults", [](const E& e) { return e.epoch.faults; })
      .def("__reduce__",
           [](const E& /*epoch*/) -> py::object {
             throw py::type_error("an Epoch cannot be pickled: use its table(), or the tables of the run");
           })
      .def(
          "table", [](const EpochPtr& e, const std::string& name) { return table_of({e}, name); }, "name"_a,
          "Columns of this epoch alone: \"epochs\", \"satellites\", \"signals\", \"paths\".");
  py::class_<EpochEncoder>(m, "Encoder", "Encodes epochs to bytes, as in `canyon simulate`.")
      .def("begin", &EpochEncoder::begin)
      .def("encode", &EpochEncoder::encode, "epoch"_a)
      .def("end", &EpochEncoder::end);
}

// Tables of epochs as columns: all of encoding::tables(), with the instant as UTC first.

py::dict table_of(const std::vector<EpochPtr>& epochs, const std::string& name) {
  const encoding::Table& table = table_named(name);
  std::vector<std::int64_t> times;
  std::vector<Values> values;
  for (const Column& column : table.columns) values.emplace_back(column);
  encoding::TableRows rows(table.kind, epochs.empty() ? tracking::SignalOptions{} : *epochs.front()->signal);
  for (const EpochPtr& epoch : epochs) {
    rows.each(epoch->epoch, [&](const Row& row) {
      times.push_back(unix_ns(row.epoch.observed.time));
      for (Values& column : values) column.add(row);
    });
  }
  py::dict columns;
  columns["time"] = datetimes(std::move(times));
  for (Values& column : values) columns[column.column().name] = std::move(column).array();
  return columns;
}

/// Column name to (unit, CF standard name, meaning).
py::dict columns_of(const std::string& name) {
  py::dict about;
  about["time"] = py::make_tuple("", "time", "instant of reception, UTC");
  for (const Column& column : table_named(name).columns)
    about[column.name] = py::make_tuple(column.cf_unit(), column.standard_name, column.help);
  return about;
}

}  // namespace canyon::python
