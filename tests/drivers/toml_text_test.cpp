// Text that toml11 alone would read wild at, or recurse into.
#include "drivers/toml_text.h"

#include <gtest/gtest.h>

#include <sstream>

namespace wasp::drivers {
namespace {

std::string error_of(const std::string& text) {
  std::istringstream in(text);
  try {
    parse_toml(in, "t.toml");
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return {};
}

TEST(TomlText, TakesWhatIsToml) {
  EXPECT_EQ(error_of(""), "");
  EXPECT_EQ(error_of("a = 'gr\u00fc\u00df'\nb = \"\xF0\x9F\x90\x9D\" # \xE2\x82\xAC\n"), "");
  EXPECT_EQ(error_of("a = " + std::string(200, '[') + std::string(200, ']') + "\n"), "");
  std::istringstream in("[a]\nb = 3\n");
  EXPECT_EQ(parse_toml(in, "t.toml").at("a").at("b").as_integer(), 3);
}

TEST(TomlText, InvalidUtf8IsRefusedByLine) {
  for (const char* bytes :
       {"\xFF", "\x80", "\xC0\x80", "\xC3", "\xE0\x80\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xF0\x9F\x90"})
    for (const char* quote : {"'", "\"", "'''", "\"\"\""})
      EXPECT_NE(error_of("x = 1\na = " + std::string(quote) + bytes + quote + "\n").find("t.toml:2: not UTF-8"),
                std::string::npos);
}

TEST(TomlText, DeepNestingIsRefused) {
  EXPECT_NE(error_of("\na = " + std::string(100'000, '[')).find("t.toml:2: nested too deep"), std::string::npos);
  std::string tables = "a = ", key = "a";
  for (int i = 0; i < 100'000; ++i) tables += "{b=", key += ".a";
  EXPECT_NE(error_of(tables).find("nested too deep"), std::string::npos);
  EXPECT_NE(error_of(key + " = 1\n").find("t.toml:1: a key of too many parts"), std::string::npos);
  EXPECT_NE(error_of("[" + key + "]\n").find("t.toml:1: a key of too many parts"), std::string::npos);
}

TEST(TomlText, EndlessAndMissingFilesAreRefusedByName) {
  EXPECT_NE(error_of(std::string(kLongestToml + 1, '\n')).find("t.toml: longer"), std::string::npos);
  for (const char* file : {"/dev/zero", "/", "/nowhere/a.toml"}) {
    try {
      parse_toml_file(file);
      ADD_FAILURE() << file;
    } catch (const std::runtime_error& e) {
      EXPECT_NE(std::string(e.what()).find(file), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace wasp::drivers
