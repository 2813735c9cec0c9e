// Laws of JSON output: the text is valid JSON, keeps the order of insertion, and gives back every number.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/io/json.hpp"

namespace liealign {
namespace {

TEST(Json, ObjectKeepsTheOrderOfInsertion) {
  Json json;
  json["zeta"] = 1;
  json["alpha"] = "two";
  json["zeta"] = 3;  // the same key again replaces in place
  EXPECT_EQ(dump_json(json), "{\n  \"zeta\": 3,\n  \"alpha\": \"two\"\n}");
}

TEST(Json, EveryKindOfValueHasItsText) {
  EXPECT_EQ(dump_json({}), "null");
  EXPECT_EQ(dump_json(nullptr), "null");
  EXPECT_EQ(dump_json(true), "true");
  EXPECT_EQ(dump_json(false), "false");
  EXPECT_EQ(dump_json(-7), "-7");
  EXPECT_EQ(dump_json(std::size_t{7}), "7");
  EXPECT_EQ(dump_json(std::numeric_limits<std::int64_t>::min()), "-9223372036854775808");
  EXPECT_EQ(dump_json(0.1), "0.1");
  EXPECT_EQ(dump_json(std::string("text")), "\"text\"");
  EXPECT_EQ(dump_json(JsonArray{}), "[]");
  EXPECT_EQ(dump_json(JsonObject{}), "{}");
  EXPECT_EQ(dump_json(std::optional<double>(2.5)), "2.5");
  EXPECT_EQ(dump_json(std::optional<double>()), "null");
  EXPECT_EQ(dump_json(std::vector<double>{1.5, 2.5}), "[1.5, 2.5]");
  EXPECT_EQ(dump_json(std::vector<std::string>{"a", "b"}, 0), "[\"a\", \"b\"]");
}

TEST(Json, NumbersWithoutAJsonFormAreNull) {
  EXPECT_EQ(dump_json(JsonArray{std::nan(""), std::numeric_limits<double>::infinity(), 1.0}), "[null, null, 1]");
}

TEST(Json, DoublesReadBackToTheSameBits) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    const auto x = std::bit_cast<double>(random());
    if (!std::isfinite(x)) continue;
    const std::string text = dump_json(x);
    double back = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), back);
    ASSERT_EQ(end, text.data() + text.size()) << text;
    ASSERT_EQ(std::bit_cast<std::uint64_t>(back), std::bit_cast<std::uint64_t>(x)) << text;
  }
}

TEST(Json, ArraysOfPlainNumbersStandOnOneLine) {
  const Json json = JsonObject{{"curve", JsonArray{JsonArray{1, 2.5}, JsonArray{-3, std::nan("")}}},
                               {"words", JsonArray{"a", 1}},
                               {"empty", JsonObject{}}};
  EXPECT_EQ(dump_json(json),
            "{\n"
            "  \"curve\": [\n"
            "    [1, 2.5],\n"
            "    [-3, null]\n"
            "  ],\n"
            "  \"words\": [\n"
            "    \"a\",\n"
            "    1\n"
            "  ],\n"
            "  \"empty\": {}\n"
            "}");
}

TEST(Json, IndentSetsTheSpacesAndZeroMeansOneLine) {
  Json json;
  json["a"]["b"] = 1;
  json["c"].push_back("x");
  EXPECT_EQ(dump_json(json, 4), "{\n    \"a\": {\n        \"b\": 1\n    },\n    \"c\": [\n        \"x\"\n    ]\n}");
  EXPECT_EQ(dump_json(json, 0), "{\"a\": {\"b\": 1}, \"c\": [\"x\"]}");
}

TEST(Json, StringsAndKeysAreEscaped) {
  EXPECT_EQ(dump_json(std::string("\" \\ / \b\f\n\r\t \x01\x1f\x7f") + '\0'),
            "\"\\\" \\\\ / \\b\\f\\n\\r\\t \\u0001\\u001f\x7f\\u0000\"");
  EXPECT_EQ(dump_json(JsonObject{{"a\"b", 1}}, 0), "{\"a\\\"b\": 1}");
}

TEST(Json, Utf8PassesAndOtherBytesBecomeTheReplacementCharacter) {
  const std::string good = "\u00e9\u20ac\ud7ff\U0001F681\U0010FFFF";
  EXPECT_EQ(dump_json(good), "\"" + good + "\"");
  const std::string bad = "\uFFFD";
  EXPECT_EQ(dump_json("caf\xe9!"), "\"caf" + bad + "!\"");                        // Latin-1
  EXPECT_EQ(dump_json("\xc3"), "\"" + bad + "\"");                                // cut off
  EXPECT_EQ(dump_json("\xc0\xaf"), "\"" + bad + bad + "\"");                      // overlong '/'
  EXPECT_EQ(dump_json("\xe0\x80\xaf"), "\"" + bad + bad + bad + "\"");            // overlong '/'
  EXPECT_EQ(dump_json("\xed\xa0\x80"), "\"" + bad + bad + bad + "\"");            // surrogate
  EXPECT_EQ(dump_json("\xf4\x90\x80\x80"), "\"" + bad + bad + bad + bad + "\"");  // above U+10FFFF
}

TEST(Json, MisuseThrows) {
  Json number = 1;
  EXPECT_THROW(number["a"], Error);
  EXPECT_THROW(number.push_back(1), Error);
  EXPECT_THROW(Json{std::numeric_limits<std::uint64_t>::max()}, Error);
}

}  // namespace
}  // namespace liealign
