// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "chart/number_text.h"
#include "page/residual_charts.h"

namespace sheaf {
namespace {

/// How a reason bears on the verdict.
enum class Weight { sound, look, wrong };

struct Reason {
  Weight weight = Weight::sound;
  std::string words, remedy;  ///< text
};

std::string capital(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 32);
  return text;
}

std::string sentence(const std::string& text) {
  if (text.empty()) return "";
  return capital(text) + (text.back() == '.' ? "" : ".");
}

/// Findings say what is wrong and, behind a colon or semicolon, what it means and what to do.
/// One of thousands of observations that is wrong leaves the result what it is.
Reason reason_of(const Finding& finding, std::uint64_t observations) {
  const bool few = finding.of == "observations" && finding.count * 1000 <= observations;
  const Weight weight = finding.grave && !few ? Weight::wrong : Weight::look;
  const std::string& words = finding.words;
  const std::size_t colon = words.find(": "), semicolon = words.find("; ");
  const std::size_t at = colon != std::string::npos ? colon : semicolon;
  if (at == std::string::npos) return {weight, words, ""};
  return {weight, words.substr(0, at), words.substr(at + 2)};
}

std::optional<Reason> ending(const RunRecord* run) {
  if (run == nullptr || run->words.empty()) return {};
  const auto steps = run->steps.empty() ? 0 : run->steps.size() - 1;
  std::string words = run->words + "; " + count_text(steps, "step", "steps");
  if (std::isfinite(run->solve_s)) words += ", " + seconds_text(run->solve_s);
  return Reason{run->converged() ? Weight::sound : Weight::wrong, words, ""};
}

std::optional<Reason> tail(const PageScene& scene) {
  if (!(scene.sigma > 0)) return {};
  const double beyond = share_beyond(scene.after, 4 * scene.sigma);
  return Reason{beyond < 0.01 ? Weight::sound : Weight::look,
                percent(beyond) + " of the residuals are longer than four times the noise",
                "Gaussian noise would put 0.03" + std::string(kThinSpace) + "% there"};
}

/// What covariances say: directions that measurements leave open, and how well the rest is known.
void add_precision(const Covariance& known, bool surveyed, std::vector<Reason>& reasons) {
  constexpr std::size_t kShown = 2;
  if (!known.weak.empty()) {
    std::string words;
    for (std::size_t k = 0; k < std::min(kShown, known.weak.size()); ++k)
      words += (k > 0 ? "; " : "") + known.weak[k].words;
    if (known.weak.size() > kShown)
      words += "; and " + std::to_string(known.weak.size() - kShown) + " more of the kind";
    reasons.push_back(
        {Weight::look, words, "hold them (--fix), share the lens, or take images that cover it"});
  }
  if (known.undetermined_points > 0)
    reasons.push_back({Weight::look,
                       count_text(known.undetermined_points, "point is", "points are") +
                           " not determined by what is measured",
                       "leave them out (convert --min-track 2, --min-angle)"});
  if (surveyed && known.deficit < 7) {
    std::string open;
    for (const std::string& freedom : known.freedoms) open += (open.empty() ? "" : ", ") + freedom;
    reasons.push_back(
        {Weight::sound,
         known.deficit == 0
             ? "the survey fixes where the scene lies, how it is turned and how large it is"
             : "the survey leaves " + std::to_string(known.deficit) +
                   " of the scene's seven freedoms" + (open.empty() ? "" : ": " + open),
         known.deficit == 0 ? "sigmas are those of its frame: its positions, points and distances "
                              "count in them"
                            : "sigmas are relative to the images' mean place in these"});
    return;
  }
  // Told of a survey alone, and not given its terms, nobody knows.
  if (known.deficit < 7 || surveyed) return;
  reasons.push_back({Weight::sound,
                     "where the scene lies, how it is turned and how large it is rests on no "
                     "measurement",
                     "sigmas are relative to the images' mean place; a survey (--constraints) "
                     "would fix them"});
}

void add_survey(const RunSurvey& survey, std::vector<Reason>& reasons) {
  std::size_t blunders = 0;
  double most = 0;
  std::string worst;
  for (const auto* list : {&survey.positions, &survey.control, &survey.check})
    for (const RunSurveyResidual& r : *list)
      if (r.blunder) {
        if (r.worst_sigmas > most)
          worst = r.name + " is off by " + digits(r.worst_sigmas) + " sigmas";
        most = std::max(most, r.worst_sigmas);
        ++blunders;
      }
  if (blunders > 0)
    reasons.push_back({Weight::look,
                       count_text(blunders, "survey residual is", "survey residuals are") +
                           " larger than its sigma allows: " + worst,
                       "check coordinates, marks and sigmas"});
}

/// Escaped, with options of the command kept on one line.
std::string words_html(const std::string& text) {
  std::string out = escaped(sentence(text));
  for (std::size_t at = out.find("--"); at != std::string::npos; at = out.find("--", at)) {
    const std::size_t end =
        std::min(out.size(), out.find_first_not_of("abcdefghijklmnopqrstuvwxyz-", at));
    out.insert(end, "</span>");
    out.insert(at, "<span class=\"nw\">");
    at = end + 24;
  }
  return out;
}

std::string item(const Reason& reason) {
  static constexpr std::array<const char*, 3> kMarks = {"ok", "look", "wrong"};
  static constexpr std::array<const char*, 3> kClasses = {"okk", "lk", "at"};
  const auto w = static_cast<std::size_t>(reason.weight);
  const std::string remedy =
      reason.remedy.empty() ? "" : " <small>" + words_html(reason.remedy) + "</small>";
  return std::string("<li class=\"") + kClasses[w] + "\"><i>" + kMarks[w] + "</i><div>" +
         words_html(reason.words) + remedy + "</div></li>";
}

std::string number_word(std::size_t n) {
  static constexpr std::array<const char*, 9> kWords = {"two",   "three", "four", "five", "six",
                                                        "seven", "eight", "nine", "ten"};
  if (n == 1) return "one";
  return n <= 10 ? kWords[n - 2] : std::to_string(n);
}

std::string headline(const RunRecord* run, const std::vector<Reason>& reasons) {
  std::size_t wrong = 0, look = 0;
  for (const Reason& reason : reasons) {
    wrong += reason.weight == Weight::wrong;
    look += reason.weight == Weight::look;
  }
  const bool ended = run != nullptr && !run->words.empty(), well = ended && run->converged();
  if (ended && !well) --wrong;  // said in the first half
  const std::string first = !ended ? "" : well ? "Converged" : "Stopped before it converged";
  if (wrong > 0) {
    const std::string what =
        number_word(wrong) + (wrong == 1 ? " thing is wrong." : " things are wrong.");
    return first.empty() ? capital(what) : first + (well ? ", but " : ", and ") + what;
  }
  if (look > 0) {
    const std::string what =
        number_word(look) + (look == 1 ? " thing is worth a look." : " things are worth a look.");
    return first.empty() ? capital(what) : first + "; " + what;
  }
  if (first.empty()) return "Nothing looks wrong.";
  return first + (well ? "; nothing looks wrong." : ".");
}

std::string key_figure(const std::string& name, const std::string& value, const char* unit,
                       const std::string& below) {
  return "<div><dt>" + escaped(name) + "</dt><dd><b>" + value + "</b>" +
         (*unit == '\0' ? "" : std::string("<u>") + unit + "</u>") + "<small>" + escaped(below) +
         "</small></dd></div>";
}

std::string key_figures(const PageScene& scene, const Covariance* known) {
  const bool start = scene.has_start && scene.before.counted > 0;
  const auto was = [&](double before, const std::string& otherwise) {
    return start ? "was " + with_unit(before, "px") : otherwise;
  };
  if (scene.after.counted == 0) return "";
  std::string out =
      key_figure("Residual, rms", digits(scene.after.rms), "px",
                 was(scene.before.rms, "of all observations")) +
      key_figure("Noise, from the median", digits(scene.sigma), "px", "σ of one coordinate");
  if (known != nullptr && known->sigma_estimated)
    out += key_figure("Unit weight, σ₀", digits(known->sigma), "",
                      grouped(std::int64_t(std::llround(known->redundancy))) + " redundant");
  out += key_figure("99" + std::string(kThinSpace) + "% are within", digits(scene.after.q99), "px",
                    was(scene.before.q99, "of all observations"));
  if (!scene.worst.empty())
    out += key_figure("Worst image, rms", digits(scene.after.image_rms[scene.worst[0]]), "px",
                      scene.names[scene.worst[0]]);
  std::uint64_t seen = 0, twice = 0;
  for (const std::uint32_t t : scene.track) {
    seen += t > 0;
    twice += t == 2;
  }
  if (seen > 0)
    out += key_figure("Track length, mean", digits(double(scene.order.size()) / double(seen)), "",
                      percent(double(twice) / double(seen)) + " seen twice only");
  return out;
}

}  // namespace

Verdict verdict(const PageScene& scene, const PageFacts& facts) {
  std::vector<Reason> reasons;
  for (const Finding& finding : facts.findings)
    reasons.push_back(reason_of(finding, scene.order.size()));
  if (facts.run != nullptr && facts.run->survey) add_survey(*facts.run->survey, reasons);
  if (const auto end = ending(facts.run)) reasons.push_back(*end);
  const bool told_far = std::any_of(facts.findings.begin(), facts.findings.end(),
                                    [](const Finding& f) { return f.code == "far-off"; });
  if (!told_far)
    if (const auto found = tail(scene)) reasons.push_back(*found);
  if (facts.covariance != nullptr)
    add_precision(*facts.covariance, facts.run != nullptr && facts.run->survey, reasons);
  std::stable_sort(reasons.begin(), reasons.end(),
                   [](const Reason& a, const Reason& b) { return a.weight > b.weight; });
  Verdict out{headline(facts.run, reasons), "", key_figures(scene, facts.covariance)};
  for (const Reason& reason : reasons) out.reasons += item(reason);
  return out;
}

}  // namespace sheaf
