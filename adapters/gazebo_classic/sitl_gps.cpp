#include "adapters/gazebo_classic/sitl_gps.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/message.h>

#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

namespace pb = google::protobuf;

/// One field: its name and number on PX4's side, and the member with its value.
struct Field {
  const char* name;
  int number;
  bool required;
  std::uint64_t SitlGps::*integer;  ///< null: `real`
  double SitlGps::*real;
};
constexpr std::array<Field, 11> kFields{{
    {"time_usec", 1, true, &SitlGps::time_usec, nullptr},
    {"time_utc_usec", 2, false, &SitlGps::time_utc_usec, nullptr},
    {"latitude_deg", 3, true, nullptr, &SitlGps::latitude_deg},
    {"longitude_deg", 4, true, nullptr, &SitlGps::longitude_deg},
    {"altitude", 5, true, nullptr, &SitlGps::altitude_m},
    {"eph", 6, false, nullptr, &SitlGps::eph_m},
    {"epv", 7, false, nullptr, &SitlGps::epv_m},
    {"velocity", 8, false, nullptr, &SitlGps::velocity_mps},
    {"velocity_east", 9, false, nullptr, &SitlGps::velocity_east_mps},
    {"velocity_north", 10, false, nullptr, &SitlGps::velocity_north_mps},
    {"velocity_up", 11, false, nullptr, &SitlGps::velocity_up_mps},
}};

/// The type made at run time, in its own pool, so that PX4's may be loaded later. It lives as long as the
/// process: messages in transit outlive their publisher.
const pb::Message& run_time_prototype() {
  static const pb::Message* const prototype = [] {
    pb::FileDescriptorProto file;
    file.set_name("canyon/sitl_gps.proto");
    file.set_package("sensor_msgs.msgs");
    pb::DescriptorProto& type = *file.add_message_type();
    type.set_name("SITLGps");
    for (const Field& field : kFields) {
      pb::FieldDescriptorProto& f = *type.add_field();
      f.set_name(field.name);
      f.set_number(field.number);
      f.set_type(field.integer != nullptr ? pb::FieldDescriptorProto::TYPE_UINT64
                                          : pb::FieldDescriptorProto::TYPE_DOUBLE);
      f.set_label(field.required ? pb::FieldDescriptorProto::LABEL_REQUIRED
                                 : pb::FieldDescriptorProto::LABEL_OPTIONAL);
    }
    static auto* const pool = new pb::DescriptorPool;
    static auto* const factory = new pb::DynamicMessageFactory;
    return factory->GetPrototype(pool->BuildFile(file)->message_type(0));
  }();
  return *prototype;
}

/// Sets a field by name, if the class has it, in its number type: PX4 changed types between releases.
void set(pb::Message& message, const Field& field, const SitlGps& gps) {
  const pb::FieldDescriptor* const f = message.GetDescriptor()->FindFieldByName(field.name);
  if (f == nullptr || f->is_repeated()) return;
  const double real = field.integer != nullptr ? static_cast<double>(gps.*field.integer) : gps.*field.real;
  const std::uint64_t integer = field.integer != nullptr ? gps.*field.integer : 0;
  const pb::Reflection& reflection = *message.GetReflection();
  switch (f->cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection.SetDouble(&message, f, real);
    case pb::FieldDescriptor::CPPTYPE_FLOAT:
      return reflection.SetFloat(&message, f, static_cast<float>(real));
    case pb::FieldDescriptor::CPPTYPE_UINT64:
      if (field.integer != nullptr) reflection.SetUInt64(&message, f, integer);
      return;
    case pb::FieldDescriptor::CPPTYPE_INT64:
      if (field.integer != nullptr) reflection.SetInt64(&message, f, static_cast<std::int64_t>(integer));
      return;
    default:
      return;
  }
}

}  // namespace

std::optional<SitlGps> sitl_gps_of(const live::ReceiverReport& report) {
  if (report.step == nullptr) return std::nullopt;
  const receiver::ReceiverEpoch& seen = report.step->epoch.observed;
  const positioning::Fix& fix = seen.fix;
  if (!fix.measured() || !fix.velocity_enu_mps) return std::nullopt;
  SitlGps gps;
  gps.time_usec = static_cast<std::uint64_t>(report.sim_time_ns / 1000);
  gps.time_utc_usec = static_cast<std::uint64_t>(geodesy::unix_from_gps(seen.time) / 1000);
  gps.latitude_deg = geodesy::degrees(fix.position.latitude_rad);
  gps.longitude_deg = geodesy::degrees(fix.position.longitude_rad);
  gps.altitude_m = report.step->epoch.altitude_m();
  gps.eph_m = std::sqrt(fix.covariance_enu(0, 0) + fix.covariance_enu(1, 1));
  gps.epv_m = std::sqrt(fix.covariance_enu(2, 2));
  const Eigen::Vector3d& velocity = *fix.velocity_enu_mps;
  gps.velocity_mps = velocity.head<2>().norm();
  gps.velocity_east_mps = velocity.x();
  gps.velocity_north_mps = velocity.y();
  gps.velocity_up_mps = velocity.z();
  return gps;
}

SitlGpsMessage::SitlGpsMessage() = default;
SitlGpsMessage::~SitlGpsMessage() = default;

void SitlGpsMessage::choose_class() {
  // Checked again until the process has it: its library may be loaded with a model that is inserted later.
  if (generated_) return;
  const pb::Descriptor* const type =
      pb::DescriptorPool::generated_pool()->FindMessageTypeByName(kSitlGpsType);
  const pb::Message* const prototype =
      type != nullptr ? pb::MessageFactory::generated_factory()->GetPrototype(type) : nullptr;
  if (prototype != nullptr) {
    message_.reset(prototype->New());
    generated_ = true;
  } else if (!message_) {
    message_.reset(run_time_prototype().New());
  }
}

const google::protobuf::Message* SitlGpsMessage::fill(const SitlGps& gps) {
  choose_class();
  message_->Clear();
  for (const Field& field : kFields) set(*message_, field, gps);
  problem_ = message_->IsInitialized() ? "" : message_->InitializationErrorString();
  return problem_.empty() ? message_.get() : nullptr;
}

}  // namespace canyon::adapters::gazebo_classic
