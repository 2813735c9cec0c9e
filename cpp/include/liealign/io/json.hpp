// A small JSON tree for alignment.json, summary.json and the like: written, never parsed (RFC 8259).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "liealign/core/error.hpp"

namespace liealign {

struct Json;

// A template, so that it becomes complete where Json does: the constructors of Json already need it.
template <typename Value>
struct JsonMemberOf {
  std::string key;
  Value value;
};
using JsonMember = JsonMemberOf<Json>;
using JsonArray = std::vector<Json>;
using JsonObject = std::vector<JsonMember>;  // in the order of insertion, which is the order of the text

// One JSON value. Builds itself from what the engine has at hand:
//
//   Json summary;                                  // null, becomes an object at the first key
//   summary["fixes"] = fixes.size();
//   summary["heading_std_deg"] = std::optional<double>{};   // null, as is a NaN
//   summary["lever_arm_b_m"] = JsonArray{0.1, -0.05, -0.3};
struct Json {
  std::variant<std::nullptr_t, bool, std::int64_t, double, std::string, JsonArray, JsonObject> value = nullptr;

  Json() = default;
  Json(std::nullptr_t) {}
  template <std::same_as<bool> Bool>  // exactly bool: no pointer may turn into true
  Json(Bool b) : value(b) {}
  template <std::integral Int>
  requires(!std::same_as<Int, bool>) Json(Int i) : value(checked(i)) {}
  Json(double x) : value(x) {}
  Json(const char* text) : value(std::string(text)) {}
  Json(std::string_view text) : value(std::string(text)) {}
  Json(std::string text) : value(std::move(text)) {}
  Json(JsonArray items) : value(std::move(items)) {}
  Json(JsonObject members) : value(std::move(members)) {}
  Json(const std::vector<double>& numbers) : value(JsonArray(numbers.begin(), numbers.end())) {}
  Json(const std::vector<std::string>& texts) : value(JsonArray(texts.begin(), texts.end())) {}
  template <typename T>
  Json(const std::optional<T>& maybe) : Json(maybe ? Json(*maybe) : Json()) {}

  // The member with this key, appended as null where there is none: a key stands once. Throws Error on a value
  // that is neither an object nor null. The reference holds until the next new key.
  Json& operator[](std::string_view key);

  // Appends to an array (or turns null into one). Throws Error on anything else.
  void push_back(Json item);

 private:
  template <std::integral Int>
  static std::int64_t checked(Int i) {
    if (!std::in_range<std::int64_t>(i)) throw Error("an integer above 9223372036854775807 does not fit JSON output");
    return static_cast<std::int64_t>(i);
  }
};

// The text, without a newline at the end. Doubles in the shortest form that reads back to the same bits, NaN and
// infinities as null, arrays of plain numbers on one line, bytes that are not UTF-8 as U+FFFD.
// indent = 0 puts everything on one line.
std::string dump_json(const Json& json, int indent = 2);

}  // namespace liealign
