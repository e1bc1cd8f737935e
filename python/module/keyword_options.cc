// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "keyword_options.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <set>
#include <variant>

#include "arrays.h"
#include "options/words.h"
#include "sheaf/error.h"

namespace sheaf {
namespace {

[[noreturn]] void refuse_type(const OptionSpec& spec, const char* expected, nb::handle value) {
  const std::string text = identifier_of(spec) + ": expected " + expected +
                           (spec.nothing ? " or None" : "") + ", not " + type_of(value);
  throw nb::type_error(text.c_str());
}

bool is_text(nb::handle value) { return PyUnicode_Check(value.ptr()); }

std::string text_from(nb::handle value) {
  return nb::cast<std::string>(nb::str(nb::module_::import_("os").attr("fspath")(value)));
}

OptionValue flag_from(const OptionSpec& spec, nb::handle value) {
  const nb::object boolean = nb::module_::import_("numpy").attr("bool_");
  if (!PyBool_Check(value.ptr()) && !nb::isinstance(value, boolean))
    refuse_type(spec, "True or False", value);
  return nb::cast<bool>(nb::bool_(nb::borrow(value)));
}

OptionValue whole_from(const OptionSpec& spec, nb::handle value) {
  if (PyBool_Check(value.ptr()) || !PyIndex_Check(value.ptr()))
    refuse_type(spec, "a whole number", value);
  // Through its digits: what no 64 bits hold is refused with the range in the message.
  const nb::object whole = nb::module_::import_("operator").attr("index")(value);
  return parse(spec, nb::cast<std::string>(nb::str(whole))).value();
}

OptionValue real_from(const OptionSpec& spec, nb::handle value) {
  const bool fits =
      !is_text(value) && PyNumber_Check(value.ptr()) && nb::hasattr(value, "__float__");
  if (PyBool_Check(value.ptr()) || (!fits && !PyIndex_Check(value.ptr())))
    refuse_type(spec, "a number", value);
  return nb::cast<double>(nb::float_(nb::borrow(value)));
}

OptionValue list_from(const OptionSpec& spec, nb::handle value) {
  if (is_text(value)) return split_items(nb::cast<std::string>(value));
  std::vector<std::string> out;
  if (value.is_none() || !PySequence_Check(value.ptr()))
    refuse_type(spec, "a list of texts, or a text", value);
  for (nb::handle item : nb::borrow<nb::object>(value)) {
    if (!is_text(item)) refuse_type(spec, "a list of texts", item);
    out.push_back(nb::cast<std::string>(item));
  }
  return out;
}

OptionValue value_from(const OptionSpec& spec, nb::handle value) {
  if (value.is_none() && spec.nothing) return {};
  switch (spec.kind) {
    case OptionKind::flag:
      return flag_from(spec, value);
    case OptionKind::whole:
      return whole_from(spec, value);
    case OptionKind::real:
      return real_from(spec, value);
    case OptionKind::bytes:
      if (is_text(value)) return parse(spec, nb::cast<std::string>(value)).value();
      return whole_from(spec, value);
    case OptionKind::list:
      return list_from(spec, value);
    case OptionKind::choice:
      if (!is_text(value)) refuse_type(spec, "a text", value);
      return parse(spec, nb::cast<std::string>(value)).value();
    case OptionKind::text:
      break;
  }
  if (!is_text(value) && !nb::hasattr(value, "__fspath__")) refuse_type(spec, "a text", value);
  return text_from(value);
}

void set_option(const BoundOption& option, nb::handle given) {
  try {
    const OptionValue value = value_from(option.spec, given);
    accept(option.spec, value).value();
    option.put(value);
  } catch (const Error& error) {
    throw Error(error.code(), identifier_of(option.spec) + ": " + error.what());
  }
}

std::string identifier_named(const std::string& name) { return identifier_of({.name = name}); }

void check_company(const OptionSpec& spec, const std::set<std::string>& given) {
  for (const std::string& name : spec.needs)
    if (!given.contains(identifier_named(name)))
      throw Error(ErrorCode::usage, identifier_of(spec) + " needs " + identifier_named(name));
  for (const std::string& name : spec.excludes)
    if (given.contains(identifier_named(name)))
      throw Error(ErrorCode::usage,
                  identifier_of(spec) + " goes not with " + identifier_named(name));
}

std::string annotation_of(const OptionSpec& spec) {
  std::string out;
  switch (spec.kind) {
    case OptionKind::flag:
      out = "bool";
      break;
    case OptionKind::whole:
      out = "int";
      break;
    case OptionKind::real:
      out = "float";
      break;
    case OptionKind::bytes:
      out = "int | str";
      break;
    case OptionKind::list:
      out = "collections.abc.Sequence[str] | str";
      break;
    case OptionKind::text:
      out = "str";
      break;
    case OptionKind::choice: {
      std::vector<std::string> names;
      for (const OptionChoice& choice : spec.choices) names.push_back("'" + choice.name + "'");
      out = "typing.Literal[" + listed(names) + "]";
      break;
    }
  }
  return spec.nothing ? out + " | None" : out;
}

nb::object object_of(const OptionValue& value) {
  struct Visitor {
    nb::object operator()(std::monostate) const { return nb::none(); }
    nb::object operator()(bool b) const { return nb::bool_(b); }
    nb::object operator()(std::int64_t n) const { return nb::int_(n); }
    nb::object operator()(double x) const { return nb::float_(x); }
    nb::object operator()(const std::string& s) const { return nb::cast(s); }
    nb::object operator()(const std::vector<std::string>& l) const {
      return nb::tuple(nb::cast(l));
    }
  };
  return std::visit(Visitor(), value);
}

}  // namespace

void take_options(nb::dict& keywords, const std::vector<BoundOption>& options) {
  std::set<std::string> given;
  for (const BoundOption& option : options) {
    const std::string name = identifier_of(option.spec);
    if (!keywords.contains(name.c_str())) continue;
    set_option(option, keywords[name.c_str()]);
    if (object_of(option.get()).equal(nb::bool_(false))) {
      nb::del(keywords[name.c_str()]);
      continue;  // a flag that is not raised
    }
    nb::del(keywords[name.c_str()]);
    given.insert(name);
  }
  for (const BoundOption& option : options)
    if (given.contains(identifier_of(option.spec))) check_company(option.spec, given);
}

void check_all_taken(const nb::dict& keywords, const char* function) {
  for (auto [key, value] : keywords) {
    const std::string text = std::string(function) + "() got an unexpected keyword argument '" +
                             nb::cast<std::string>(nb::str(key)) + "'";
    throw nb::type_error(text.c_str());
  }
}

std::string signature_of(const std::string& name, const std::string& before,
                         const std::vector<std::string>& after,
                         const std::vector<BoundOption>& options, const std::string& result) {
  std::string out = "def " + name + "(" + before + (before.empty() ? "*" : ", *");
  for (const BoundOption& option : options)
    out += ", " + identifier_of(option.spec) + ": " + annotation_of(option.spec) + " = " +
           nb::cast<std::string>(nb::repr(object_of(option.get())));
  for (const std::string& keyword : after) out += ", " + keyword;
  return out + ") -> " + result;
}

std::string help_of(const std::vector<BoundOption>& options) {
  std::string out;
  for (const BoundOption& option : options)
    out += "\n  " + identifier_of(option.spec) + ": " + help_text(option.spec);
  return out;
}

nb::dict values_of(const std::vector<BoundOption>& options) {
  nb::dict out;
  for (const BoundOption& option : options)
    out[identifier_of(option.spec).c_str()] = object_of(option.get());
  return out;
}

std::vector<BoundOption> without(std::vector<BoundOption> options,
                                 const std::vector<std::string>& names) {
  std::erase_if(options, [&](const BoundOption& option) {
    return std::find(names.begin(), names.end(), option.spec.name) != names.end();
  });
  return options;
}

}  // namespace sheaf
