#include <canyon/canyon.hpp>
#include <fstream>
#include <iostream>

int main() {
  using namespace canyon;
  const auto config =
      simulation::parse_live_config("{start: 2026-06-01T08:00:00Z, profile: ublox-m10}", "loop");
  const auto scene = std::make_shared<simulation::CityScene>(city::synthetic_city({}));
  simulation::ReceiverRunner receiver(config, scene, config.start.value());
  const auto track = encoding::format_named("kml").make(encoding::describe_receivers(receiver, 0.2).front());
  encoding::SummarySink metrics({"car"});
  std::ofstream file("loop.kml");
  file << track->begin();
  for (int step = 0; step < 250; ++step) {  // your loop: 4 m/s to the east along the middle street
    const double seconds = 0.2 * step;
    simulation::RigidPose antenna;
    antenna.position_m = {4 * seconds, 0, 1.5};
    antenna.linear_velocity = {4, 0, 0};
    const simulation::ReceiverRunner::Step now = receiver.observe(seconds, antenna);
    // now.epoch.observed.fix: the receiver's fix; now.arrival: its signal paths.
    file << track->encode(now.epoch);
    metrics.write(now.epoch);
  }
  file << track->end();
  metrics.finish();
  std::cout << encoding::format_summary_table(metrics.summaries());
}
