#include "canyon/validation/models.hpp"

#include <algorithm>

#include "canyon/base/named.hpp"

namespace canyon::validation {

std::vector<Model> model_ladder(const simulation::ReceiverConfig& receiver) {
  simulation::ReceiverConfig step = receiver;
  propagation::PropagationOptions& paths = step.propagation;
  paths.model = propagation::Model::Mirror;
  paths.reflection_order = 1;
  paths.ground_reflection = paths.diffraction = paths.diffuse = false;
  step.options.signal.enabled = false;
  const bool shadowing = step.options.signal.shadowing.enabled;

  std::vector<Model> models;
  const auto add = [&](const char* key, const char* name) { models.push_back({key, name, step}); };
  add("mirror", "mirror (the paper's)");
  paths.model = propagation::Model::Specular;
  add("specular", "specular, first order");
  paths.reflection_order = 2;
  add("second", "+ second order");
  step.options.signal.enabled = true;
  step.options.signal.shadowing.enabled = false;
  add("tracking", "+ strength and tracking");
  paths.diffuse = true;
  add("diffuse", "+ diffuse scattering");
  paths.ground_reflection = true;
  add("ground", "+ ground reflection");
  step.options.signal.shadowing.enabled = true;
  add("shadowing", "+ shadowing");
  step.options.signal.shadowing.enabled = shadowing;
  paths.diffraction = true;
  add("diffraction", "+ diffraction");
  return models;
}

std::vector<Model> models_of(const simulation::ReceiverConfig& receiver,
                             const std::vector<std::string>& keys) {
  const std::vector<Model> ladder = model_ladder(receiver);
  std::vector<std::string> known;
  for (const Model& model : ladder) known.push_back(model.key);
  for (const std::string& key : keys) {
    if (std::find(known.begin(), known.end(), key) == known.end()) throw unknown_name("model", key, known);
  }
  std::vector<Model> chosen;
  for (const Model& model : ladder) {
    if (std::find(keys.begin(), keys.end(), model.key) != keys.end()) chosen.push_back(model);
  }
  return chosen;
}

}  // namespace canyon::validation
