// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/loss_option.h"

#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "geometry/known_kinds.h"
#include "geometry/loss.h"
#include "options/words.h"
#include "platform/real_text.h"

namespace sheaf {
namespace {

constexpr LossKind kLosses[] = {LossKind::none,   LossKind::huber, LossKind::soft_l1,
                                LossKind::cauchy, LossKind::tukey, LossKind::geman_mcclure};

std::optional<LossKind> loss_named(std::string_view name) {
  for (const LossKind kind : kLosses)
    if (name == to_string(kind)) return kind;
  return {};
}

std::string names_but_none() {
  std::vector<std::string> names;
  for (const LossKind kind : kLosses)
    if (kind != LossKind::none) names.emplace_back(to_string(kind));
  return listed(names, " or ");
}

bool read_scale(std::string_view text, double& scale) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = read_real(text.data(), end, scale);
  return error == std::errc() && stop == end && scale > 0 && std::isfinite(scale);
}

/// The text up to the next colon, and what is behind it.
std::vector<std::string_view> parts_of(std::string_view text) {
  std::vector<std::string_view> out;
  for (std::size_t colon = text.find(':'); colon != std::string_view::npos;
       colon = text.find(':')) {
    out.push_back(text.substr(0, colon));
    text.remove_prefix(colon + 1);
  }
  out.push_back(text);
  return out;
}

/// Name, scale and :gnc, whatever the form allows of them.
std::optional<Loss> read_loss(std::string_view text) {
  std::vector<std::string_view> parts = parts_of(text);
  const std::optional<LossKind> kind = loss_named(parts[0]);
  if (!kind) return {};
  Loss loss{*kind, kAutomaticScale, parts.size() > 1 && parts.back() == "gnc"};
  if (loss.graduated) parts.pop_back();
  if (*kind == LossKind::none)
    return parts.size() == 1 && !loss.graduated ? std::optional(loss) : std::nullopt;
  if (parts.size() > 2) return {};
  if (parts.size() == 2 && parts[1] != "auto" && !read_scale(parts[1], loss.scale_px)) return {};
  return loss;
}

std::string scale_words(const LossForm& form) {
  return std::string("a :SCALE above 0 in ") + form.unit;
}

}  // namespace

Result<Loss> parse_loss(const LossForm& form, const std::string& text) {
  const auto wrong = [](const std::string& what) { return Error(ErrorCode::usage, what); };
  const std::optional<Loss> loss = read_loss(text);
  const bool unscaled = loss && loss->kind != LossKind::none && loss->scale_px == kAutomaticScale;
  if (!loss || (unscaled && !form.automatic))
    return wrong("expected none, or " + names_but_none() + " with " +
                 (form.automatic ? ":auto or " : "") + scale_words(form) + ", not '" + text + "'");
  if (!loss->graduated) return *loss;
  if (!form.graduated) return wrong("expected a loss without :gnc, not '" + text + "'");
  if (is_convex(loss->kind))
    return wrong(std::string(to_string(loss->kind)) +
                 " is convex: :gnc is for cauchy, tukey and geman-mcclure");
  return *loss;
}

std::string text_of(const Loss& loss) {
  if (!is_known(loss.kind)) return "loss " + std::to_string(static_cast<int>(loss.kind));
  const bool automatic = loss.scale_px == kAutomaticScale;
  const bool plain =
      loss.kind == LossKind::none && loss.scale_px >= 0 && std::isfinite(loss.scale_px);
  std::string out = to_string(loss.kind);
  if (!plain) out += ":" + (automatic ? "auto" : text_of(OptionValue(loss.scale_px)));
  return out + (loss.graduated ? ":gnc" : "");
}

std::string placeholder_of(const LossForm& form) {
  return std::string("NAME[:SCALE") + (form.automatic ? "|:auto]" : "]") +
         (form.graduated ? "[:gnc]" : "");
}

std::string help_of(const LossForm& form) {
  std::string out = "none, or " + names_but_none() + " as NAME:SCALE in " + form.unit;
  if (form.automatic) out += " or NAME:auto (the scale follows the median residual, in rounds)";
  if (form.graduated)
    out += "; :gnc at the end of the last three starts wide and tightens the scale";
  return out;
}

}  // namespace sheaf
