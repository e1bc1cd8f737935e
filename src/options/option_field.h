// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "options/option.h"

namespace sheaf {

/// An option, and where its value lives in a struct of options. The default is what a fresh struct
/// holds, so that it is stated once.
template <class Options>
struct OptionField {
  OptionSpec spec;
  std::function<OptionValue(const Options&)> get;
  std::function<void(Options&, const OptionValue&)> put;  ///< what `accept` has accepted

  OptionValue fallback() const { return get(Options()); }
  /// Errors: ErrorCode::usage, as of `accept`; the struct is then as it was.
  Result<void> set(Options& options, const OptionValue& value) const {
    if (Result<void> good = accept(spec, value); !good.ok()) return good;
    put(options, value);
    return {};
  }
  /// The same from text, as the command line has it.
  Result<void> set_text(Options& options, const std::string& text) const {
    const Result<OptionValue> value = parse(spec, text);
    if (!value.ok()) return value.error();
    put(options, value.value());
    return {};
  }
};

template <class Options>
using OptionTable = std::vector<OptionField<Options>>;

/// Errors: ErrorCode::usage, naming the first field that is out of its range.
template <class Options>
Result<void> check_fields(const OptionTable<Options>& table, const Options& options) {
  for (const OptionField<Options>& field : table)
    if (const Result<void> good = accept(field.spec, field.get(options)); !good.ok())
      return Error(ErrorCode::usage, key_of(field.spec) + ": " + good.error().what());
  return {};
}

/// An option of a struct that is at hand, for code that does not ask of what type that is.
struct BoundOption {
  OptionSpec spec;
  std::function<OptionValue()> get;
  std::function<void(const OptionValue&)> put;  ///< what `accept` has accepted
};

/// In the table's order, which is the order in which to set them. The struct outlives them.
template <class Options>
std::vector<BoundOption> bound(const OptionTable<Options>& table, Options& options) {
  std::vector<BoundOption> out;
  for (const OptionField<Options>& field : table)
    out.push_back({field.spec, [&options, get = field.get] { return get(options); },
                   [&options, put = field.put](const OptionValue& value) { put(options, value); }});
  return out;
}

/// Makes the fields of one struct. `at` is what std::invoke takes to a reference to the value: a
/// pointer to a member, or a lambda for what lies deeper.
template <class Options>
struct FieldsOf {
  using Field = OptionField<Options>;
  template <class At>
  using Value = std::remove_cvref_t<std::invoke_result_t<At, Options&>>;

  /// Any: `get` and `put` say how.
  template <class Get, class Put>
  static Field made(OptionKind kind, OptionSpec spec, Get get, Put put) {
    spec.kind = kind;
    return {std::move(spec), std::move(get), std::move(put)};
  }

  template <class At>
  static Field flag(At at, OptionSpec spec) {
    return plain<bool>(OptionKind::flag, at, std::move(spec));
  }

  template <class At>
  static Field text(At at, OptionSpec spec) {
    return plain<std::string>(OptionKind::text, at, std::move(spec));
  }

  template <class At>
  static Field list(At at, OptionSpec spec) {
    return plain<std::vector<std::string>>(OptionKind::list, at, std::move(spec));
  }

  /// An integer of any type; the range ends where the type does.
  template <class At>
  static Field whole(At at, OptionSpec spec, OptionKind kind = OptionKind::whole) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    using Integer = Value<At>;
    constexpr auto kHighest = std::numeric_limits<Integer>::max();
    spec.range.highest = std::min(spec.range.highest, static_cast<double>(kHighest));
    return made(
        kind, std::move(spec),
        [at](const Options& o) -> OptionValue {
          const Integer value = std::invoke(at, o);
          return std::cmp_greater(value, kMost) ? kMost : static_cast<std::int64_t>(value);
        },
        [at](Options& o, const OptionValue& value) {
          std::invoke(at, o) = static_cast<Integer>(std::get<std::int64_t>(value));
        });
  }

  /// Bytes: likewise, also with a unit.
  template <class At>
  static Field bytes(At at, OptionSpec spec) {
    spec.unit = "bytes";
    return whole(at, std::move(spec), OptionKind::bytes);
  }

  template <class At>
  static Field real(At at, OptionSpec spec) {
    return plain<double>(OptionKind::real, at, std::move(spec));
  }

  /// A number up to infinity, which is nothing: no limit.
  template <class At>
  static Field limit(At at, OptionSpec spec) {
    spec.nothing = true;
    spec.range.highest = std::numeric_limits<double>::infinity();
    return made(
        OptionKind::real, std::move(spec),
        [at](const Options& o) -> OptionValue {
          const double value = std::invoke(at, o);
          return value == std::numeric_limits<double>::infinity() ? OptionValue() : value;
        },
        [at](Options& o, const OptionValue& value) {
          const double* number = std::get_if<double>(&value);
          std::invoke(at, o) = number ? *number : std::numeric_limits<double>::infinity();
        });
  }

  /// A number that is 0 in the struct where nothing is asked for.
  template <class At>
  static Field unless_zero(At at, OptionSpec spec) {
    Field field;
    if constexpr (std::is_integral_v<Value<At>>) {
      field = whole(at, std::move(spec));
    } else {
      field = real(at, std::move(spec));
    }
    field.spec.nothing = true;
    field.get = [at, get = field.get](const Options& o) {
      return std::invoke(at, o) == 0 ? OptionValue() : get(o);
    };
    field.put = [at, put = field.put](Options& o, const OptionValue& value) {
      if (std::holds_alternative<std::monostate>(value)) {
        std::invoke(at, o) = 0;
      } else {
        put(o, value);
      }
    };
    return field;
  }

  template <class Enum>
  struct Choice {
    Enum value;
    std::string name;
    std::string meaning{};
  };

  /// An enumerator, or a bool with two names.
  template <class At>
  static Field choice(At at, std::vector<Choice<Value<At>>> choices, OptionSpec spec) {
    for (const auto& c : choices) spec.choices.push_back({c.name, c.meaning});
    return made(
        OptionKind::choice, std::move(spec),
        [at, choices](const Options& o) -> OptionValue {
          for (const auto& c : choices)
            if (c.value == std::invoke(at, o)) return c.name;
          return std::string();
        },
        [at, choices](Options& o, const OptionValue& value) {
          for (const auto& c : choices)
            if (c.name == std::get<std::string>(value)) std::invoke(at, o) = c.value;
        });
  }

  /// A string that is one of some names, or empty where nothing is asked for.
  template <class At>
  static Field name(At at, std::vector<OptionChoice> choices, OptionSpec spec) {
    spec.choices = std::move(choices);
    return plain<std::string>(OptionKind::choice, at, std::move(spec));
  }

 private:
  template <class Held, class At>
  static Field plain(OptionKind kind, At at, OptionSpec spec) {
    const bool nothing = spec.nothing;
    return made(
        kind, std::move(spec),
        [at, nothing](const Options& o) -> OptionValue {
          Held held(std::invoke(at, o));
          return nothing && held == Held() ? OptionValue() : OptionValue(std::move(held));
        },
        [at](Options& o, const OptionValue& value) {
          const Held* held = std::get_if<Held>(&value);
          std::invoke(at, o) = held != nullptr ? *held : Held();
        });
  }
};

}  // namespace sheaf
