#pragma once

#include <optional>

#include "canyon/study/record.hpp"

namespace canyon::study {

/// Makes the records of a run's receivers from its epochs.
class RecordSink final : public simulation::EpochSink {
 public:
  /// @param available_m Study::available_m
  RecordSink(const std::vector<std::string>& receivers, std::optional<double> available_m, bool keep_epochs);
  void write(const simulation::Epoch& epoch) override;
  void finish() override {}
  [[nodiscard]] std::vector<ReceiverRecord> take();

 private:
  output::SummarySink summary_;
  std::vector<ReceiverRecord> records_;
  std::optional<double> available_m_;
  bool keep_;
  std::optional<geodesy::GpsTime> first_;
  struct Way {
    std::optional<Eigen::Vector3d> last_ecef;
    double gone_m = 0;
  };
  std::vector<Way> ways_;  ///< by receiver
};

}  // namespace canyon::study
