// Declared in canyon/validation/report/report_pictures.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/output/number.hpp"
#include "canyon/validation/report/report_pictures.hpp"
#include "canyon/validation/report/report_samples.hpp"

namespace canyon::validation {
namespace {

using drawing::Canvas;
using drawing::Point;

constexpr double kSide = 560, kStrip = 88, kPredictionLeft = 88, kPredictionTop = 100;

/// Observations that paths of one kind explain.
struct Kind {
  std::vector<double> predicted_m, measured_m;
};

struct Look {
  std::string_view kind;
  drawing::Mark mark;
  drawing::Colour colour;
};
/// In the order of the table; the last one is for any other kind.
constexpr std::array<Look, 5> kLooks{{{"reflected 1", drawing::Mark::Disc, drawing::kBlue},
                                      {"reflected 2", drawing::Mark::Square, drawing::kSkyBlue},
                                      {"diffracted", drawing::Mark::Triangle, drawing::kVermilion},
                                      {"diffuse", drawing::Mark::Diamond, drawing::kGreen},
                                      {"", drawing::Mark::Cross, drawing::kPurple}}};
constexpr Look kNoPath{"", drawing::Mark::Ring, drawing::kFaintInk};

/// Kinds come in the order of their looks.
struct ByLook {
  static std::size_t rank(const std::string& kind) {
    std::size_t k = 0;
    while (k + 1 < kLooks.size() && kLooks[k].kind != kind) ++k;
    return k;
  }
  bool operator()(const std::string& a, const std::string& b) const {
    return std::pair(rank(a), a) < std::pair(rank(b), b);
  }
};
const Look& look_of(const std::string& kind) {
  return kLooks[ByLook::rank(kind)];
}

class Prediction {
 public:
  explicit Prediction(const ReportInput& input) : input_(input) {
    std::vector<double> all_errors{0};
    for (std::size_t e = input.first; e < input.first + input.count; ++e) {
      for (const ComparedSatellite& s : satellites_of(*input.comparison, input.comparison->epochs[e])) {
        if (s.clear || !s.measured || !s.measured_error_m) continue;
        all_errors.push_back(*s.measured_error_m);
        if (!s.prediction) {
          without_.push_back(*s.measured_error_m);
          continue;
        }
        for (Kind* kind : {&kinds_[path_words(*s.prediction)], &all_}) {
          kind->predicted_m.push_back(s.prediction->excess_m);
          kind->measured_m.push_back(*s.measured_error_m);
        }
      }
    }
    const double high =
        std::max({10.0, *quantile(all_errors, 0.99), quantile(all_.predicted_m, 0.99).value_or(0)});
    y_ = drawing::linear_scale(std::min(0.0, *quantile(all_errors, 0.005)), high, 7);
    // Metres are as long on both axes, and x begins with the tick below the least prediction.
    x_ = y_;
    const double least = std::min(0.0, quantile(all_.predicted_m, 0.005).value_or(0));
    for (const double tick : y_.ticks) {
      if (tick <= least + 1e-9) x_.low = tick;
    }
    x_.ticks.erase(x_.ticks.begin(), std::find(x_.ticks.begin(), x_.ticks.end(), x_.low));
    unit_ = kSide / (y_.high - y_.low);
  }

  [[nodiscard]] double width() const { return kPredictionLeft + kStrip + unit_ * (x_.high - x_.low) + 410; }

  void draw(Canvas& canvas) {
    drawing::draw_title(canvas, kPredictionLeft, "Measured NLOS errors over the predicted code delay",
                        report_subtitle(input_));
    drawing::Plot strip{{kPredictionLeft, kPredictionTop, kStrip, kSide},
                        {0, 1, false, {}},
                        y_,
                        "",
                        "Measured pseudorange error [m]",
                        {}};
    drawing::Plot plot{{kPredictionLeft + kStrip, kPredictionTop, unit_ * (x_.high - x_.low), kSide},
                       x_,
                       y_,
                       "Predicted code delay [m]",
                       "",
                       {}};
    strip.draw_ground(canvas);
    plot.draw_ground(canvas);
    const double end = std::min(x_.high, y_.high), begin = std::max(x_.low, y_.low);
    canvas.polyline({plot.at(begin, begin), plot.at(end, end)}, {drawing::kInk, 1.2, {6, 4}});
    for (const auto& [name, kind] : kinds_) {
      const Look& look = look_of(name);
      for (std::size_t i = 0; i < kind.measured_m.size(); ++i) {
        draw_value(canvas, plot, kind.predicted_m[i], kind.measured_m[i], look);
      }
    }
    for (std::size_t i = 0; i < without_.size(); ++i) {
      // Spread across the strip by the golden ratio: evenly, whatever their number.
      const double across = 0.1 + 0.8 * std::fmod(0.6180339887 * static_cast<double>(i), 1.0);
      draw_value(canvas, strip, across, without_[i], kNoPath);
    }
    strip.draw_frame(canvas);
    plot.y.ticks.clear();
    plot.draw_frame(canvas);
    canvas.text({strip.area.centre().x, strip.area.bottom() + 9}, "no path",
                {.size = 11,
                 .colour = drawing::kFaintInk,
                 .align = drawing::Align::Centre,
                 .level = drawing::Level::Top});
    if (all_.measured_m.empty()) {
      plot.draw_note(canvas, without_.empty() ? "no NLOS satellite was measured"
                                              : "no measured NLOS error is predicted");
    }
    draw_table(canvas, {plot.area.right() + 26, kPredictionTop + 10});
  }

 private:
  void draw_value(Canvas& canvas, const drawing::Plot& plot, double x, double y, const Look& look) {
    if (x < plot.x.low || x > plot.x.high || y < plot.y.low || y > plot.y.high) ++beyond_;
    drawing::Colour colour = look.colour;
    if (look.mark != drawing::Mark::Ring) colour = colour.with_alpha(0.75);
    drawing::draw_mark(canvas, plot.at(x, y), look.mark, look.mark == drawing::Mark::Ring ? 2.4 : 3.4,
                       colour);
  }

  void draw_table(Canvas& canvas, Point at) const {
    constexpr std::array kColumns{196.0, 286.0, 352.0};
    const drawing::TextStyle left{.size = 12, .level = drawing::Level::Middle};
    drawing::TextStyle right = left;
    right.align = drawing::Align::Right;
    drawing::TextStyle head = right;
    head.colour = drawing::kFaintInk;
    const auto cells = [&](const std::array<std::string, 3>& texts, const drawing::TextStyle& style) {
      for (std::size_t k = 0; k < texts.size(); ++k) canvas.text({at.x + kColumns[k], at.y}, texts[k], style);
    };
    canvas.text({at.x, at.y}, "Path that explains",
                {.size = 12, .bold = true, .level = drawing::Level::Middle});
    cells({"n", "|difference|", "rho"}, head);
    at.y += 17;
    cells({"", "median [m]", ""}, head);
    at.y += 23;
    const auto row = [&](const std::string& name, const Kind& kind) {
      std::vector<double> differences;
      for (std::size_t i = 0; i < kind.measured_m.size(); ++i) {
        differences.push_back(std::abs(kind.measured_m[i] - kind.predicted_m[i]));
      }
      const auto middle = median(differences);
      const auto rho = spearman(kind.predicted_m, kind.measured_m);
      canvas.text({at.x + 28, at.y}, name, left);
      cells({fmt::format("{}", differences.size()), middle ? output::fixed(*middle, 1) : "\u2013",
             rho ? output::fixed(rho->rho, 2) : "\u2013"},
            right);
      at.y += 22;
    };
    for (const auto& [name, kind] : kinds_) {
      const Look& look = look_of(name);
      drawing::draw_mark(canvas, {at.x + 10, at.y}, look.mark, 4.6, look.colour);
      row(name, kind);
    }
    row("all with a path", all_);
    drawing::draw_mark(canvas, {at.x + 10, at.y}, drawing::Mark::Ring, 4.6, drawing::kFaintInk);
    canvas.text({at.x + 28, at.y}, "no path predicted", left);
    canvas.text({at.x + kColumns[0], at.y}, fmt::format("{}", without_.size()), right);
    at.y += 30;
    canvas.polyline({{at.x, at.y}, {at.x + 22, at.y}}, {drawing::kInk, 1.2, {6, 4}});
    canvas.text({at.x + 28, at.y}, "measured as predicted (1 : 1)", left);
    at.y += 26;
    const drawing::TextStyle note{.size = 11, .colour = drawing::kFaintInk, .level = drawing::Level::Middle};
    canvas.text(at, "rho: Spearman's rank correlation", note);
    at.y += 18;
    if (beyond_ > 0) {
      canvas.text(at, fmt::format("{} beyond the axes, drawn on the frame", beyond_), note);
    }
  }

  const ReportInput& input_;
  std::map<std::string, Kind, ByLook> kinds_;
  Kind all_;
  std::vector<double> without_;
  drawing::Scale x_, y_;
  double unit_ = 1;
  std::size_t beyond_ = 0;
};

}  // namespace

drawing::Picture draw_report_prediction(const ReportInput& input) {
  const double width = Prediction(input).width();
  return drawing::render(width, kPredictionTop + kSide + 62,
                         [&](Canvas& canvas) { Prediction(input).draw(canvas); });
}

}  // namespace canyon::validation
