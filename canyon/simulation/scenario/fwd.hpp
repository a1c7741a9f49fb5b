#pragma once

namespace canyon::simulation {

struct CityConfig;
class Environment;
struct Georeference;
struct OutputConfig;
struct ReceiverConfig;
struct Scenario;
struct SkyConfig;

}  // namespace canyon::simulation
