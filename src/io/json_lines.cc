// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/json_lines.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>

#include "io/line_cursor.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;
constexpr std::size_t kDeepest = 100;

std::string number_shown(double x) {
  char buffer[40];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr);
}

/// Walks over a text and leaves how far it came where the handler can see it.
class WatchedIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  WatchedIterator(const char* at, const char** seen) : at_(at), seen_(seen) {}
  reference operator*() const { return *at_; }
  WatchedIterator& operator++() {
    *seen_ = ++at_;
    return *this;
  }
  WatchedIterator operator++(int) {
    WatchedIterator old = *this;
    ++*this;
    return old;
  }
  bool operator==(const WatchedIterator& other) const { return at_ == other.at_; }

 private:
  const char* at_;
  const char** seen_;
};

/// Builds the value from the parser's events.
class Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit Builder(const std::string& text)
      : text_(text), seen_(text.data()), counted_(text.data()) {}
  const char** seen() { return &seen_; }
  JsonValue root;
  std::string refusal;

  /// A number is known to have ended by the character behind it, which may be a line's end. Lines
  /// are counted from where they were counted to before.
  std::uint64_t line() {
    const char* const end = seen_ > text_.data() ? seen_ - 1 : seen_;
    line_ += static_cast<std::uint64_t>(std::count(counted_, end, '\n'));
    counted_ = end;
    return line_;
  }

  bool null() override { return add(Kind::null); }
  bool boolean(bool value) override {
    const bool good = add(Kind::boolean);
    if (good) last_->boolean = value;
    return good;
  }
  bool number_integer(number_integer_t value) override {
    return add_number(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return add_number(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return add_number(value); }
  bool string(string_t& value) override {
    const bool good = add(Kind::text);
    if (good) last_->text = value;
    return good;
  }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Kind::object); }
  bool start_array(std::size_t) override { return open(Kind::list); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& value) override {
    key_ = value;
    return true;
  }
  bool parse_error(std::size_t, const std::string&,
                   const nlohmann::detail::exception& error) override {
    const bool ended = std::string_view(error.what()).find("end of input") != std::string::npos;
    refusal = ended || seen_ == text_.data()
                  ? "the end of the text"
                  : sheaf::quoted(std::string_view(seen_ - 1, 1)) + " where it cannot stand";
    return false;
  }

 private:
  bool add(Kind kind) {
    JsonValue* place = &root;
    if (!open_.empty()) {
      JsonValue& parent = *open_.back();
      place = parent.kind == Kind::list ? &parent.items.emplace_back()
                                        : &parent.members.emplace_back(JsonMember{key_, {}}).value;
    }
    place->kind = kind;
    place->line = line();
    last_ = place;
    return true;
  }
  bool add_number(double value) {
    const bool good = add(Kind::number);
    if (good) last_->number = value;
    return good;
  }
  /// Values that are open do not move: their parents get no further child before they close.
  bool open(Kind kind) {
    if (open_.size() >= kDeepest) {
      refusal = "lists or objects more than " + std::to_string(kDeepest) + " deep";
      return false;
    }
    add(kind);
    open_.push_back(last_);
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  const std::string& text_;
  const char* seen_;
  const char* counted_;  ///< lines before it are those of line_
  std::uint64_t line_ = 1;
  JsonValue* last_ = nullptr;
  std::vector<JsonValue*> open_;
  std::string key_;
};

}  // namespace

const JsonValue* JsonValue::find(const std::string& name) const {
  const JsonValue* found = nullptr;
  for (const auto& [key, value] : members)
    if (key == name) found = &value;
  return found;
}

std::string JsonValue::shown() const {
  switch (kind) {
    case Kind::null:
      return "null";
    case Kind::boolean:
      return boolean ? "true" : "false";
    case Kind::number:
      return number_shown(number);
    case Kind::text:
      return sheaf::quoted(text);
    case Kind::list:
      return "a list of " + std::to_string(items.size());
    case Kind::object:
      return "an object";
  }
  return "";
}

Result<JsonValue> parse_json(const std::string& text, const std::string& name) {
  Builder builder(text);
  const char* const end = text.data() + text.size();
  const bool good = nlohmann::json::sax_parse(WatchedIterator(text.data(), builder.seen()),
                                              WatchedIterator(end, builder.seen()), &builder);
  if (good) return std::move(builder.root);
  return Error(ErrorCode::unreadable_input, name + ":" + std::to_string(builder.line()) +
                                                ": found " + builder.refusal + ", expected JSON");
}

}  // namespace sheaf
