#pragma once

#include <string>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::validation {

/// A receiver and its propagation as one step on the way to all that Canyon models.
struct Model {
  std::string key;   ///< one word, for command lines: "specular"
  std::string name;  ///< for people; "+ ..." adds to the step before
  simulation::ReceiverConfig receiver;
  bool moved_city = false;  ///< the map's place drawn anew for each run, by the scenario's georeference
};

/// The steps, each with what the one before has: mirror (the paper's model), specular (reflections of first
/// order), second (and of second), tracking (strength of signals and the receiver's tracking, with
/// `receiver`'s own SignalOptions), diffuse, ground, shadowing (by what no map has), diffraction. The last
/// one has shadowing where `receiver` has. Numbers that a step does not switch are `receiver`'s.
[[nodiscard]] std::vector<Model> model_ladder(const simulation::ReceiverConfig& receiver);

/// The ladder's models with these keys, in the ladder's order. Throws InputError for a key it does not have,
/// naming those there are.
[[nodiscard]] std::vector<Model> models_of(const simulation::ReceiverConfig& receiver,
                                           const std::vector<std::string>& keys);

}  // namespace canyon::validation
