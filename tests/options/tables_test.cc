// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// What holds for every entry of every table of options.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "options/loss_option.h"
#include "options/noise_options.h"
#include "options/option_field.h"
#include "options/photometric_options.h"
#include "options/refinement.h"
#include "options/scene_options.h"
#include "options/solve_options.h"

namespace sheaf {
namespace {

template <class Options>
const OptionTable<Options>& table_of();
template <>
const OptionTable<SolveOptions>& table_of() {
  return solve_fields();
}
template <>
const OptionTable<PhotometricOptions>& table_of() {
  return photometric_fields();
}
template <>
const OptionTable<PhotometricReadOptions>& table_of() {
  return photometric_read_fields();
}
template <>
const OptionTable<RefinementArguments>& table_of() {
  static const auto kTable = refinement_fields("hold");
  return kTable;
}

template <>
const OptionTable<SceneOptions>& table_of() {
  return scene_fields();
}
template <>
const OptionTable<PhotometricSceneOptions>& table_of() {
  return photometric_scene_fields();
}
template <>
const OptionTable<NoiseOptions>& table_of() {
  return noise_fields();
}

/// Another value than the default.
OptionValue other_value(const OptionSpec& spec, const OptionValue& fallback) {
  const OptionRange& range = spec.range;
  switch (spec.kind) {
    case OptionKind::flag:
      return !std::get<bool>(fallback);
    case OptionKind::whole:
    case OptionKind::bytes: {
      const std::int64_t next = std::get<std::int64_t>(fallback) + 1;
      return range.has(static_cast<double>(next)) ? next : next - 2;
    }
    case OptionKind::real: {
      const double* number = std::get_if<double>(&fallback);
      const double next = number ? *number / 2 + 0.3 : 0.75;
      return range.has(next) ? next : std::nextafter(range.highest, 0);
    }
    case OptionKind::choice:
      for (const OptionChoice& choice : spec.choices)
        if (OptionValue(choice.name) != fallback) return choice.name;
      return {};
    case OptionKind::text:
      for (const char* text : {"cauchy:1.5", "500,501.5,320", "500,501.5,320,240", "elsewhere"})
        if (!spec.wrong || spec.wrong(text).empty()) return std::string(text);
      return {};
    case OptionKind::list:
      return std::vector<std::string>{"k1", "pose=left,1.png"};
  }
  return {};
}

/// Values that no range has.
std::vector<OptionValue> wrong_values(const OptionSpec& spec) {
  const OptionRange& range = spec.range;
  if (spec.kind == OptionKind::real) {
    std::vector<OptionValue> out = {std::nan(""), std::nextafter(range.lowest, -1e300)};
    if (range.above) out.emplace_back(range.lowest);
    if (std::isfinite(range.highest))
      out.emplace_back(std::nextafter(range.highest, std::numeric_limits<double>::infinity()));
    return out;
  }
  if (spec.kind == OptionKind::whole && range.lowest >= 1)
    return {static_cast<std::int64_t>(range.lowest) - 1};
  return {};
}

template <class Options>
class Tables : public testing::Test {};
using All =
    testing::Types<SolveOptions, PhotometricOptions, PhotometricReadOptions, RefinementArguments,
                   SceneOptions, PhotometricSceneOptions, NoiseOptions>;
TYPED_TEST_SUITE(Tables, All);

TYPED_TEST(Tables, SayWhatIsNeededOnce) {
  std::set<std::string> names, keys;
  for (const auto& field : table_of<TypeParam>()) {
    const OptionSpec& spec = field.spec;
    EXPECT_TRUE(names.insert(spec.name).second) << spec.name;
    EXPECT_TRUE(keys.insert(key_of(spec)).second) << key_of(spec);
    EXPECT_FALSE(spec.help.empty()) << spec.name;
    EXPECT_FALSE(spec.help.ends_with('.')) << spec.name;
    EXPECT_TRUE(spec.reach == OptionReach::library || spec.kind == OptionKind::flag ||
                !spec.placeholder.empty())
        << spec.name;
    for (const std::string& other : spec.needs) EXPECT_TRUE(names.count(other)) << other;
  }
}

TYPED_TEST(Tables, DefaultsAreThoseOfTheStructAndCanBeAskedFor) {
  EXPECT_TRUE(check_fields(table_of<TypeParam>(), TypeParam()).ok());
  for (const auto& field : table_of<TypeParam>()) {
    if (field.spec.kind == OptionKind::list) continue;  // an empty list cannot be said in text
    TypeParam options;
    field.put(options, other_value(field.spec, field.fallback()));
    EXPECT_NE(field.get(options), field.fallback()) << field.spec.name;
    EXPECT_TRUE(field.set_text(options, text_of(field.fallback())).ok()) << field.spec.name;
    EXPECT_EQ(field.get(options), field.fallback()) << field.spec.name;
  }
}

TYPED_TEST(Tables, EachOptionSetsItsOwnFieldAndNoOther) {
  for (const auto& field : table_of<TypeParam>()) {
    if (field.spec.name == "protocol") continue;  // sets them all
    const OptionValue other = other_value(field.spec, field.fallback());
    TypeParam by_value, by_text;
    ASSERT_TRUE(field.set(by_value, other).ok()) << field.spec.name << " " << text_of(other);
    ASSERT_TRUE(field.set_text(by_text, text_of(other)).ok()) << field.spec.name;
    EXPECT_TRUE(check_fields(table_of<TypeParam>(), by_value).ok());
    for (const auto& each : table_of<TypeParam>()) {
      const bool same = each.spec.name == field.spec.name;
      EXPECT_EQ(each.get(by_value), same ? other : each.fallback()) << each.spec.name;
      EXPECT_EQ(each.get(by_text), same ? other : each.fallback()) << each.spec.name;
    }
  }
}

TYPED_TEST(Tables, WhatIsOutOfRangeIsNamed) {
  for (const auto& field : table_of<TypeParam>())
    for (const OptionValue& wrong : wrong_values(field.spec)) {
      TypeParam options;
      const Result<void> refused = field.set(options, wrong);
      ASSERT_FALSE(refused.ok()) << field.spec.name << " " << text_of(wrong);
      EXPECT_NE(std::string(refused.error().what()).find(text_of(wrong)), std::string::npos);
      EXPECT_EQ(field.get(options), field.fallback());
      field.put(options, wrong);
      if (field.get(options) == OptionValue()) continue;  // how the struct says nothing
      const Result<void> checked = check_fields(table_of<TypeParam>(), options);
      ASSERT_FALSE(checked.ok()) << field.spec.name << " " << text_of(wrong);
      EXPECT_EQ(std::string(checked.error().what()).find(key_of(field.spec) + ": expected "), 0u);
    }
}

TEST(NoiseFields, TheProtocolSetsWhatItWasPublishedWith) {
  NoiseOptions options;
  for (const auto& [name, text] :
       {std::pair{"point", "7"}, {"protocol", "rootba"}, {"center", "0.5"}})
    for (const auto& field : noise_fields())
      if (field.spec.name == name) {
        EXPECT_TRUE(field.set_text(options, text).ok());
      }
  const NoiseOptions published = published_noise(NoiseProtocol::rootba);
  EXPECT_EQ(options.protocol, NoiseProtocol::rootba);
  EXPECT_EQ(options.point, published.point);
  EXPECT_EQ(options.seed, published.seed);
  EXPECT_EQ(options.center, 0.5);
  EXPECT_EQ(noise_fields().front().spec.name, "protocol");
}

TEST(LossOption, ReadsWhatItWrites) {
  const LossForm any{.unit = "pixels", .graduated = true};
  for (const char* text : {"none", "huber:auto", "soft-l1:0.25", "cauchy:1e-05:gnc",
                           "tukey:auto:gnc", "geman-mcclure:2"})
    EXPECT_EQ(text_of(parse_loss(any, text).value()), text);
  EXPECT_EQ(text_of(parse_loss(any, "cauchy").value()), "cauchy:auto");
  EXPECT_EQ(text_of(parse_loss(any, "cauchy:gnc").value()), "cauchy:auto:gnc");
}

TEST(LossOption, RefusesWhatTheFormHasNot) {
  const auto refused = [](const LossForm& form, const std::string& text, const char* says) {
    const Result<Loss> loss = parse_loss(form, text);
    return !loss.ok() && std::string(loss.error().what()).find(says) != std::string::npos;
  };
  const LossForm any{.unit = "pixels", .graduated = true};
  for (const char* text : {"", "hubert", "none:1", "none:auto", "none:gnc", "huber:", "huber:0",
                           "huber:-1", "huber:inf", "huber:1px", "huber:1:2", "huber:auto:1",
                           "cauchy:gnc:1", "cauchy:1:gnc:", ":1"})
    EXPECT_TRUE(refused(any, text, "soft-l1, cauchy, tukey or geman-mcclure with :auto")) << text;
  for (const char* text : {"huber:gnc", "soft-l1:2:gnc"})
    EXPECT_TRUE(refused(any, text, "is convex")) << text;
  EXPECT_TRUE(refused({.unit = "grey levels"}, "cauchy:2:gnc", "without :gnc"));
  for (const char* text : {"huber", "huber:auto"})
    EXPECT_TRUE(refused({.unit = "standard deviations", .automatic = false}, text,
                        "with a :SCALE above 0 in standard deviations"));
}

}  // namespace
}  // namespace sheaf
