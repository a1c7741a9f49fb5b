#include "canyon/analysis/study/netcdf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <limits>

#include "canyon/analysis/heatmap/files/netcdf_file.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon::study {
namespace {

using heatmap::NetcdfFile;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
/// Runs of a chunk, also the number in memory at a time.
constexpr std::size_t kBlock = 1024;
constexpr std::size_t kEpochBlock = 4096;

class Writer {
 public:
  Writer(const std::filesystem::path& at, const std::filesystem::path& shown, const Manifest& manifest,
         std::vector<std::optional<RunRecord>>& records, const std::filesystem::path& folder)
      : file_(NetcdfFile::create(at, shown)), manifest_(manifest), records_(records), folder_(folder) {}

  void write() {
    count_epochs();
    define();
    write_names();
    for (std::size_t first = 0; first < records_.size(); first += kBlock)
      write_block(first, std::min(kBlock, records_.size() - first));
    for (std::size_t run = 0; manifest_.epochs && run < records_.size(); ++run) write_epochs(run);
    file_.close();
  }

 private:
  /// Dimensions of characters, one for each length.
  int characters(std::size_t length) {
    length = std::max<std::size_t>(1, length);
    for (const auto& [known, id] : character_dims_)
      if (known == length) return id;
    character_dims_.emplace_back(length,
                                 file_.define_dimension(fmt::format("characters_{}", length), length));
    return character_dims_.back().second;
  }
  int define(const std::string& name, nc_type type, const std::vector<int>& dims, const std::string& unit,
             const std::string& meaning) {
    const int variable = file_.define_variable(name, type, dims);
    file_.put_text(variable, "long_name", meaning);
    if (!unit.empty()) file_.put_text(variable, "units", unit);
    return variable;
  }
  int define_text(const std::string& name, int dim, std::size_t length, const std::string& meaning) {
    const int variable = define(name, NC_CHAR, {dim, characters(length)}, "", meaning);
    file_.put_text(variable, "_Encoding", "utf-8");
    return variable;
  }
  void write_text(int variable, std::size_t at, std::string text, std::size_t length) {
    text.resize(std::max<std::size_t>(1, length), '\0');
    file_.write(variable, {at, 0}, {1, text.size()}, text.data());
  }
  [[nodiscard]] const ReceiverRecord* receiver(std::size_t run, std::size_t r) const {
    for (const ReceiverRecord& each : records_[run]->receivers)
      if (each.name == manifest_.receivers[r]) return &each;
    return nullptr;
  }

  void count_epochs() {
    lengths_.assign(manifest_.axes.size(), 1);
    for (auto& record : records_) {
      assert(record);
      for (std::size_t i = 0; i < lengths_.size(); ++i)
        lengths_[i] = std::max(lengths_[i], manifest_.axes[i].label(record->at[i]).size());
      problem_length_ = std::max(problem_length_, record->problem.size());
      if (!manifest_.epochs || record->receivers.empty()) continue;
      read_epochs(folder_, *record);
      for (ReceiverRecord& receiver : record->receivers) {
        epochs_ = std::max(epochs_, receiver.kept.size());
        receiver.kept = {};
      }
    }
  }

  void define() {
    const std::size_t runs = records_.size(), receivers = manifest_.receivers.size();
    run_dim_ = file_.define_dimension("run", runs);
    receiver_dim_ = file_.define_dimension("receiver", receivers);
    const int bin_dim = file_.define_dimension("error_bin", kErrorBins);
    const int hour_dim = file_.define_dimension("hour", 24);
    file_.put_text(NC_GLOBAL, "Conventions", "CF-1.10");
    file_.put_text(NC_GLOBAL, "title", manifest_.title);
    file_.put_text(NC_GLOBAL, "source", "canyon study");
    file_.put_text(NC_GLOBAL, "canyon_study_key", manifest_.key);
    file_.put_text(NC_GLOBAL, "canyon_realizations",
                   fmt::format("{}", fmt::join(manifest_.realizations, " ")));

    run_ = define("run", NC_INT64, {run_dim_}, "1", "number of the run");
    std::size_t length = 1;
    for (const std::string& name : manifest_.receivers) length = std::max(length, name.size());
    receiver_ = define_text("receiver", receiver_dim_, length, "name of the receiver");
    seed_ = define("seed_of_run", NC_INT64, {run_dim_}, "1", "seed of the run's scenario");
    problem_ = define_text("problem", run_dim_, problem_length_, "why a run has no figures");
    define_axes();
    bin_ = define("error_bin", NC_DOUBLE, {bin_dim}, "m", "lower edge of a bin of horizontal errors");
    upper_ = define("error_bin_upper", NC_DOUBLE, {bin_dim}, "m", "its upper edge");
    hour_ = define("hour", NC_INT64, {hour_dim}, "h", "hour of the day, UTC");

    std::string coordinates = "seed_of_run";
    for (const Manifest::Coordinate& axis : manifest_.axes) coordinates += " " + axis.name;
    const std::size_t block = std::min(kBlock, runs);
    for (const encoding::SummaryMetric* metric : metrics()) {
      metrics_.push_back(define(metric->kept, NC_DOUBLE, {run_dim_, receiver_dim_},
                                encoding::cf_unit(metric->unit), metric->help));
      file_.put_number(metrics_.back(), "_FillValue", kMissing);
      file_.put_text(metrics_.back(), "coordinates", coordinates);
      file_.set_storage(metrics_.back(), {block, receivers}, block * receivers * 8);
    }
    const auto counts = [&](const char* name, int dim, std::size_t size, const char* meaning) {
      const int variable = define(name, NC_INT64, {run_dim_, receiver_dim_, dim}, "1", meaning);
      file_.put_text(variable, "coordinates", coordinates);
      file_.set_storage(variable, {block, receivers, size}, block * receivers * size * 8);
      return variable;
    };
    errors_ = counts("error_count", bin_dim, kErrorBins, "epochs with a fix, by horizontal error");
    hour_epochs_ = counts("hour_epochs", hour_dim, 24, "epochs by hour of the day");
    hour_available_ = counts("hour_available", hour_dim, 24,
                             manifest_.available_m ? "epochs with a fix within available_m, by hour"
                                                   : "epochs with a fix, by hour");
    if (manifest_.available_m) file_.put_number(NC_GLOBAL, "canyon_available_m", *manifest_.available_m);

    if (manifest_.epochs) {
      epochs_ = std::max<std::size_t>(1, epochs_);
      epoch_dim_ = file_.define_dimension("epoch", epochs_);
      const auto define_kept = [&](const char* name, const std::string& unit, const char* meaning) {
        const int variable = define(name, NC_DOUBLE, {run_dim_, receiver_dim_, epoch_dim_}, unit, meaning);
        file_.put_number(variable, "_FillValue", kMissing);
        file_.put_text(variable, "coordinates", coordinates);
        const std::size_t chunk = std::min(kEpochBlock, epochs_);
        file_.set_storage(variable, {1, receivers, chunk}, receivers * epochs_ * 8 + (1U << 16));
        kept_.push_back(variable);
      };
      define_kept("time_of_epoch", "s", "since the run's first epoch");
      for (const encoding::Column* column : stored_columns())
        define_kept(column->kept, column->cf_unit(), column->help);
      define_kept("way_of_epoch", "m", "that the antenna has gone since the run's first epoch");
    }
    file_.end_definitions();
  }

  void define_axes() {
    for (std::size_t i = 0; i < manifest_.axes.size(); ++i) {
      const Manifest::Coordinate& axis = manifest_.axes[i];
      const std::string meaning = axis.key.empty() ? axis.name : axis.key;
      switch (axis.kind) {
        case Manifest::Coordinate::Kind::Number:
          axes_.push_back(define(axis.name, NC_DOUBLE, {run_dim_}, "", meaning));
          break;
        case Manifest::Coordinate::Kind::Time:
          axes_.push_back(define(axis.name, NC_DOUBLE, {run_dim_}, "seconds since 1970-01-01 00:00:00",
                                 "start of the run"));
          file_.put_text(axes_.back(), "standard_name", "time");
          file_.put_text(axes_.back(), "calendar", "standard");
          break;
        case Manifest::Coordinate::Kind::Text:
          axes_.push_back(define_text(axis.name, run_dim_, lengths_[i], meaning));
          break;
      }
    }
  }

  void write_names() {
    std::size_t length = 1;
    for (const std::string& name : manifest_.receivers) length = std::max(length, name.size());
    for (std::size_t r = 0; r < manifest_.receivers.size(); ++r)
      write_text(receiver_, r, manifest_.receivers[r], length);
    std::vector<double> edges, upper;
    for (std::size_t bin = 0; bin < kErrorBins; ++bin) {
      edges.push_back(error_edge_m(bin));
      upper.push_back(error_edge_m(bin + 1));
    }
    file_.write(bin_, {0}, {kErrorBins}, edges.data());
    file_.write(upper_, {0}, {kErrorBins}, upper.data());
    std::vector<std::int64_t> hours(24);
    for (std::size_t hour = 0; hour < hours.size(); ++hour) hours[hour] = static_cast<std::int64_t>(hour);
    file_.write(hour_, {0}, {24}, hours.data());
  }

  void write_axes(std::size_t first, std::size_t count) {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      const Manifest::Coordinate& axis = manifest_.axes[i];
      std::vector<double> numbers;
      for (std::size_t run = first; run < first + count; ++run) {
        const std::string& text = records_[run]->at[i];
        switch (axis.kind) {
          case Manifest::Coordinate::Kind::Number:
            numbers.push_back(parse_double(text).value_or(kMissing));
            break;
          case Manifest::Coordinate::Kind::Time:
            numbers.push_back(heatmap::unix_seconds(geodesy::parse_simulated_time(text)));
            break;
          case Manifest::Coordinate::Kind::Text:
            write_text(axes_[i], run, axis.label(text), lengths_[i]);
            break;
        }
      }
      if (!numbers.empty()) file_.write(axes_[i], {first}, {count}, numbers.data());
    }
  }

  void write_block(std::size_t first, std::size_t count) {
    const std::size_t receivers = manifest_.receivers.size();
    std::vector<std::int64_t> numbers, seeds;
    for (std::size_t run = first; run < first + count; ++run) {
      numbers.push_back(static_cast<std::int64_t>(run));
      seeds.push_back(static_cast<std::int64_t>(records_[run]->seed));
      write_text(problem_, run, records_[run]->problem, problem_length_);
    }
    file_.write(run_, {first}, {count}, numbers.data());
    file_.write(seed_, {first}, {count}, seeds.data());
    write_axes(first, count);
    for (std::size_t k = 0; k < metrics_.size(); ++k) {
      std::vector<double> values;
      for (std::size_t run = first; run < first + count; ++run) {
        for (std::size_t r = 0; r < receivers; ++r) {
          const ReceiverRecord* from = receiver(run, r);
          values.push_back(from == nullptr ? kMissing : from->metrics[k]);
        }
      }
      file_.write(metrics_[k], {first, 0}, {count, receivers}, values.data());
    }
    const auto counts = [&](int variable, std::size_t size, const auto& of) {
      std::vector<std::int64_t> values;
      for (std::size_t run = first; run < first + count; ++run) {
        for (std::size_t r = 0; r < receivers; ++r) {
          const ReceiverRecord* from = receiver(run, r);
          for (std::size_t i = 0; i < size; ++i) values.push_back(from == nullptr ? 0 : of(*from)[i]);
        }
      }
      file_.write(variable, {first, 0, 0}, {count, receivers, size}, values.data());
    };
    counts(errors_, kErrorBins, [](const ReceiverRecord& r) { return r.errors.data(); });
    counts(hour_epochs_, 24, [](const ReceiverRecord& r) { return r.epochs.data(); });
    counts(hour_available_, 24, [](const ReceiverRecord& r) { return r.available.data(); });
  }

  void write_epochs(std::size_t run) {
    RunRecord& record = *records_[run];
    if (!record.receivers.empty()) read_epochs(folder_, record);
    const std::size_t receivers = manifest_.receivers.size();
    // In the order of their definitions: time, columns, distance.
    for (std::size_t k = 0; k < kept_.size(); ++k) {
      std::vector<double> values(receivers * epochs_, kMissing);
      for (std::size_t r = 0; r < receivers; ++r) {
        const ReceiverRecord* from = receiver(run, r);
        if (from == nullptr || from->kept.size() == 0) continue;
        const StoredEpochs& kept = from->kept;
        const auto to = values.begin() + static_cast<std::ptrdiff_t>(r * epochs_);
        if (k == 0) {
          std::copy(kept.time_s.begin(), kept.time_s.end(), to);
        } else {
          const std::vector<float>& column = k + 1 < kept_.size() ? kept.columns[k - 1] : kept.travelled_m;
          std::copy(column.begin(), column.end(), to);
        }
      }
      file_.write(kept_[k], {run, 0, 0}, {1, receivers, epochs_}, values.data());
    }
    for (ReceiverRecord& receiver : record.receivers) receiver.kept = {};
  }

  NetcdfFile file_;
  const Manifest& manifest_;
  std::vector<std::optional<RunRecord>>& records_;
  const std::filesystem::path& folder_;
  std::vector<std::pair<std::size_t, int>> character_dims_;
  std::size_t epochs_ = 0, problem_length_ = 0;
  std::vector<std::size_t> lengths_;  // of axes' texts
  int run_dim_ = 0, receiver_dim_ = 0, epoch_dim_ = 0;
  int run_ = 0, receiver_ = 0, seed_ = 0, problem_ = 0, bin_ = 0, upper_ = 0, hour_ = 0;
  int errors_ = 0, hour_epochs_ = 0, hour_available_ = 0;
  std::vector<int> axes_, metrics_, kept_;
};

}  // namespace

void write_study_netcdf(const std::filesystem::path& path, const Manifest& manifest,
                        std::vector<std::optional<RunRecord>>& records, const std::filesystem::path& folder) {
  OutputFile file(path);
  Writer(file.external_path(), path, manifest, records, folder).write();
  file.commit();
}

}  // namespace canyon::study
