// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>

#include "options/option_field.h"
#include "sheaf/error.h"
#include "sheaf/loss.h"

namespace sheaf {

/// Which losses an option takes: NAME[:SCALE|:auto][:gnc].
struct LossForm {
  const char* unit;        ///< of the scale, in words
  bool automatic = true;   ///< the scale may follow from the residuals
  bool graduated = false;  ///< it may be tightened in rounds
};

/// Errors: ErrorCode::usage, saying what is expected.
Result<Loss> parse_loss(const LossForm& form, const std::string& text);

/// "none", "huber:auto", "cauchy:1.5:gnc": what `parse_loss` reads. What makes no sense is shown.
std::string text_of(const Loss& loss);

/// "NAME[:SCALE|:auto][:gnc]"
std::string placeholder_of(const LossForm& form);

/// "none, huber, ... as NAME:SCALE in pixels or NAME:auto": follows a colon.
std::string help_of(const LossForm& form);

/// `help` says what the loss is of; the names and the form are added.
template <class Options, class At>
OptionField<Options> loss_field(At at, const LossForm& form, OptionSpec spec) {
  spec.placeholder = placeholder_of(form);
  spec.help += ": " + help_of(form);
  spec.wrong = [form](const std::string& text) {
    const Result<Loss> loss = parse_loss(form, text);
    return loss.ok() ? std::string() : std::string(loss.error().what());
  };
  return FieldsOf<Options>::made(
      OptionKind::text, std::move(spec),
      [at](const Options& o) -> OptionValue { return text_of(std::invoke(at, o)); },
      [at, form](Options& o, const OptionValue& value) {
        std::invoke(at, o) = parse_loss(form, std::get<std::string>(value)).value();
      });
}

}  // namespace sheaf
