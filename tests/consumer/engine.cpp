// A plugin has a city in memory and one antenna, and no files. Links only canyon::canyon.
#include <canyon/canyon.hpp>
#include <cstdio>

int main() {
  using namespace canyon;
  const city::City city = city::synthetic_city({});
  const auto sky = std::make_shared<orbit::FrozenSky>(city.frame.origin(), std::vector<double>{0.3, 2.0, 4.0},
                                                      std::vector<double>{1.5, 0.9, 0.2});
  const simulation::Environment environment(city, sky);
  const propagation::Propagator propagator = environment.make_propagator({});
  const propagation::Arrival arrival =
      environment.arrival(geodesy::parse_time("2019-04-28T12:58:03Z"), {0, 0, 2}, propagator);
  for (const propagation::SatelliteView& view : arrival.views) {
    std::printf("%s %s\n", gnss::to_string(view.line.id).c_str(),
                std::string(propagation::name(view.paths.visibility)).c_str());
  }
  return arrival.views.size() == 3 ? 0 : 1;
}
