#include "canyon/validation/kept_draws.hpp"

#include <fmt/format.h>

#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::validation {
namespace {

constexpr const char* kEnsembleKey = "canyon ensemble";
constexpr const char* kAnotherFile = "give --keep another file, or remove this one";

}  // namespace

std::string KeptDraws::identity(const std::vector<EnsembleRow>& rows, std::size_t count, std::uint64_t seed) {
  Json recordings = Json::array();
  for (const EnsembleRow& row : rows) {
    Json figures = Json::object();
    for (const Headline& h : row.point) figures[h.key] = Json::array({h.measured, h.simulated});
    recordings.push_back({{"name", row.name},
                          {"part", row.part},
                          {"unknowns", row.unknowns},
                          {"figures", std::move(figures)}});
  }
  return Json{{"draws", count}, {"seed", seed}, {"recordings", std::move(recordings)}}.dump();
}

KeptDraws::KeptDraws(std::filesystem::path file, const std::string& identity) : path_(std::move(file)) {
  const std::string first_line = Json{{kEnsembleKey, Json::parse(identity)}}.dump();
  if (std::filesystem::exists(path_)) {
    read(first_line);
  } else {
    write_file(path_, first_line + "\n");
  }
  appended_.open(path_, std::ios::binary | std::ios::app);
  if (!appended_) throw OutputError(path_, 0, "draws cannot be appended", "check its permissions");
}

void KeptDraws::read(const std::string& first_line) {
  TextFile file(path_);
  const bool cut = !file.text().empty() && file.text().back() != '\n';
  if (file.next_line() != first_line) throw file.error("the draws of another ensemble", kAnotherFile);
  std::string whole = first_line + "\n";
  while (const auto line = file.next_line()) {
    if (cut && !file.peek_line()) break;
    try {
      const Json draw = Json::parse(*line);
      Values& values = draws_[{draw.at("recording").text(), draw.at("draw").get<std::size_t>()}];
      for (const auto& [name, value] : draw.at("unknowns").members()) {
        values.unknowns[name] = value.get<double>();
      }
      for (const auto& [key, value] : draw.at("figures").members()) {
        values.figures[key] = value.is_null() ? std::nullopt : std::optional(value.get<double>());
      }
    } catch (const JsonError& error) {
      throw file.error(fmt::format("the line is not a valid draw: {}", error.what()), kAnotherFile);
    }
    whole.append(*line).append("\n");
  }
  if (cut) write_file(path_, whole);
}

std::optional<EnsembleRow::Draw> KeptDraws::find(const EnsembleRow& row, std::size_t draw) const {
  const auto kept = draws_.find({row.name, draw});
  if (kept == draws_.end()) return std::nullopt;
  EnsembleRow::Draw made;
  made.values = kept->second.unknowns;
  made.headlines = row.point;
  for (Headline& h : made.headlines) {
    const auto value = kept->second.figures.find(std::string(h.key));
    h.simulated = value == kept->second.figures.end() ? std::nullopt : value->second;
  }
  return made;
}

void KeptDraws::add(const std::string& recording, std::size_t draw, const EnsembleRow::Draw& made) {
  Json unknowns = Json::object(), figures = Json::object();
  for (const auto& [name, value] : made.values) unknowns[name] = value;
  for (const Headline& h : made.headlines) figures[h.key] = h.simulated;
  appended_ << Json{{"recording", recording},
                    {"draw", draw},
                    {"unknowns", std::move(unknowns)},
                    {"figures", std::move(figures)}}
                   .dump()
            << std::endl;
  if (!appended_) throw OutputError(path_, 0, "a draw was not written", "free space on its disk");
}

}  // namespace canyon::validation
