#include "adapters/gazebo_classic/testing/px4_mock/px4_mock.hpp"

#include <google/protobuf/text_format.h>

#include <cstdio>
#include <gazebo/msgs/MsgFactory.hh>
#include <gazebo/transport/transport.hh>
#include <mutex>

#include "SITLGps.pb.h"

namespace {

using sensor_msgs::msgs::SITLGps;

// Lets `gz topic` print the type if this library is preloaded.
boost::shared_ptr<google::protobuf::Message> make_message() {
  return boost::shared_ptr<google::protobuf::Message>(new SITLGps);
}
[[maybe_unused]] const bool kRegistered = [] {
  gazebo::msgs::MsgFactory::RegisterMsg("sensor_msgs.msgs.SITLGps", make_message);
  return true;
}();

std::mutex mutex;
SITLGps last;
int received = 0, foreign = 0;
gazebo::transport::NodePtr node;
gazebo::transport::SubscriberPtr subscriber;

void on_gps(const boost::shared_ptr<const SITLGps>& message) {
  const std::lock_guard lock(mutex);
  if (message) {
    ++received;
    last = *message;
  } else {
    ++foreign;
  }
}

void subscribe(const char* topic) {
  node.reset(new gazebo::transport::Node);
  node->Init();
  subscriber = node->Subscribe<SITLGps>(topic, on_gps);
}
void unsubscribe() {
  subscriber.reset();
  if (node) node->Fini();
  node.reset();
  const std::lock_guard lock(mutex);
  received = foreign = 0;
}
int count_received() {
  const std::lock_guard lock(mutex);
  return received;
}
int count_foreign() {
  const std::lock_guard lock(mutex);
  return foreign;
}
int print_last(char* text, int size) {
  const std::lock_guard lock(mutex);
  std::string out;
  google::protobuf::TextFormat::PrintToString(last, &out);
  return std::snprintf(text, static_cast<std::size_t>(size), "%s", out.c_str());
}

}  // namespace

extern "C" const canyon::adapters::gazebo_classic::test::Px4Mock px4_mock;
const canyon::adapters::gazebo_classic::test::Px4Mock px4_mock{subscribe, unsubscribe, count_received,
                                                               count_foreign, print_last};
