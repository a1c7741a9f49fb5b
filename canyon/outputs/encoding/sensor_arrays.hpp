#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/simulation/inertial/sensor_options.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::encoding {

/// Values of a sensor, a row of `columns` for each sample.
struct SensorArray {
  std::string sensor;  ///< "imu"
  std::string name;    ///< "specific_force"
  std::size_t columns = 1;
  std::string heads = {};           ///< column headers in the sensor's CSV file
  std::vector<double> values = {};  ///< row by row
};

/// Samples of a vehicle's sensors as arrays; docs/imu.md lists names, units and columns. Times are seconds
/// since the run's beginning; values of lost samples are NaN.
class SensorArrays {
 public:
  SensorArrays(const inertial::SensorOptions& sensors, geodesy::GpsTime begin);
  void add(const simulation::SensorBatch& batch);
  /// The arrays of all present sensors.
  [[nodiscard]] std::vector<SensorArray>& arrays() { return arrays_; }
  /// All samples of one of the sensors as lines of its CSV file. Fields of lost values are empty.
  [[nodiscard]] std::string csv_lines(std::string_view sensor) const;

 private:
  inertial::ImuAxes axes_;
  geodesy::GpsTime begin_;
  std::vector<SensorArray> arrays_;
};

/// The CSV files of sensors and their column headers: {"imu.csv", "gps_week,gps_tow,..."}.
[[nodiscard]] const std::map<std::string, std::string>& sensor_files();

/// A .npz file of NumPy: a ZIP archive of .npy files, stored without compression (NEP 1, format 1.0;
/// APPNOTE.TXT of PKWARE, 4.3).
class NpzWriter {
 public:
  /// @param file empty
  explicit NpzWriter(OutputFile& file) : file_(file) {}
  /// Adds an array of doubles. Throws InputError if the file would exceed 4 GiB, which ZIP cannot hold.
  /// @param columns 1: an array of one dimension
  void add(std::string_view name, const std::vector<double>& values, std::size_t columns);
  /// Writes the list of arrays after them. Call it once, last.
  void finish();

 private:
  struct Member {
    std::string name;
    std::uint32_t crc = 0, size = 0, offset = 0;
  };
  OutputFile& file_;
  std::uint64_t size_ = 0;
  std::vector<Member> members_;
};

}  // namespace canyon::encoding
