#pragma once

#include <gazebo/transport/transport.hh>
#include <string>

#include "adapters/common/testing/gnss_log.hpp"

namespace canyon::adapters::gazebo_classic::test {

/// Stores the messages that a receiver publishes on Gazebo transport.
class GnssListener : public canyon::test::GnssLog {
 public:
  GnssListener(const std::string& world, const std::string& topic) : node_(new gazebo::transport::Node()) {
    node_->Init(world);
    subscriber_ = node_->Subscribe(topic, &GnssListener::take, this);
  }
  ~GnssListener() {
    subscriber_.reset();
    node_->Fini();
  }
  GnssListener(const GnssListener&) = delete;
  GnssListener& operator=(const GnssListener&) = delete;

 private:
  void take(const boost::shared_ptr<const msgs::GnssReceiver>& message) { add(*message); }
  gazebo::transport::NodePtr node_;
  gazebo::transport::SubscriberPtr subscriber_;
};

}  // namespace canyon::adapters::gazebo_classic::test
