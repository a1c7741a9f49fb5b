#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/outputs/encoding/columns.hpp"
#include "canyon/outputs/encoding/summary.hpp"

namespace canyon::study {

/// The rows of encoding::summary_metrics() that studies store, in the order of records and files.
[[nodiscard]] std::span<const encoding::SummaryMetric* const> metrics();
/// The index of a metric in that list by SummaryMetric::kept. Precondition: it is in the list.
[[nodiscard]] std::size_t metric(std::string_view name);

/// Horizontal errors are counted in bins of a twentieth of a decade from 1 mm to 100 km; the first bin
/// includes smaller errors, the last larger ones.
inline constexpr std::size_t kErrorBins = 160;
inline constexpr double kBinsPerDecade = 20, kMinError_m = 1e-3;
[[nodiscard]] std::size_t error_bin(double error_m);
/// Lower edge of a bin [m]; of kErrorBins the upper edge of the last.
[[nodiscard]] double error_edge_m(std::size_t bin);

/// The columns of epochs that studies store (Column::kept).
[[nodiscard]] std::span<const encoding::Column* const> stored_columns();
/// The index of a column in that list by Column::kept. Precondition: it is in the list.
[[nodiscard]] std::size_t kept_column(std::string_view name);

/// Stored epochs, by columns.
struct StoredEpochs {
  std::vector<double> time_s;               ///< from the run's first epoch
  std::vector<float> travelled_m;           ///< distance travelled by the antenna since the first epoch
  std::vector<std::vector<float>> columns;  ///< by stored_columns(), none without epochs; NaN: no value

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// The results of one receiver of one run.
struct ReceiverRecord {
  std::string name;
  std::vector<double> metrics;  ///< by metrics()
  std::array<std::uint32_t, kErrorBins> errors{};
  std::array<std::uint32_t, 24> epochs{}, available{};  ///< by hour of the day, UTC
  StoredEpochs kept;                                    ///< not in the record's line
};

struct RunRecord {
  std::size_t number = 0;
  std::uint64_t seed = 0;
  std::vector<std::string> at;     ///< AxisValue::text by axis
  std::string problem;             ///< the reason if there are no metrics, else empty
  std::vector<std::string> notes;  ///< records left out and assumptions: "loss: LINE", "guess: LINE"
  std::vector<ReceiverRecord> receivers;
};

/// One line of JSON without its end, the same for the same record on any machine: numbers in the fewest
/// digits that are read back exactly, NaN as null.
[[nodiscard]] std::string to_line(const RunRecord& record);
/// Throws InputError, without a file, for texts that to_line() does not write.
[[nodiscard]] RunRecord from_line(std::string_view line);

/// The notes of all runs; equal ones once.
[[nodiscard]] ReadReport report_of(const std::vector<std::optional<RunRecord>>& records);

/// Makes the records of a run's receivers from its epochs.
class RecordSink final : public simulation::EpochSink {
 public:
  /// @param available_m Study::available_m
  RecordSink(const std::vector<std::string>& receivers, std::optional<double> available_m, bool keep_epochs);
  void write(const simulation::Epoch& epoch) override;
  void finish() override {}
  [[nodiscard]] std::vector<ReceiverRecord> take();

 private:
  encoding::SummarySink summary_;
  std::vector<ReceiverRecord> records_;
  std::optional<double> available_m_;
  bool keep_;
  std::optional<geodesy::GpsTime> first_;
  struct DistanceCounter {
    std::optional<Eigen::Vector3d> last_ecef;
    double gone_m = 0;
  };
  std::vector<DistanceCounter> distances_;  ///< by receiver
};

}  // namespace canyon::study
