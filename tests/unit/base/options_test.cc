#include "base/options.h"

#include <gtest/gtest.h>

#include <fstream>

#include "base/arguments.h"
#include "base/options_json.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::options_test {

struct Options {
  double rate_hz = 50;
  int count = 3;
  int64_t seed = 0;
  bool fast = false;
  std::string name = "a";
  std::vector<int> only;
  std::vector<std::string> words;
  std::vector<std::filesystem::path> folders;
  std::filesystem::path out;  // not in the table
};

template <class O, class F>
requires std::is_same_v<std::remove_const_t<O>, Options>
void ForEachOption(O& options, const F& f) {
  ForEachRow(
      std::tuple{Option{&Options::rate_hz, "rate_hz", "a rate", Range{20, 500}, true},
                 Option{&Options::count, "count", "how many", Range{1}},
                 Option{&Options::seed, "seed", "the seed", Range{}, true},
                 Option{&Options::fast, "fast", "a flag"}, Option{&Options::name, "name"},
                 Option{&Options::only, "only", "some", Range{0, 9}},
                 Option{&Options::words, "words", "words"}, Option{&Options::folders, "folders", "folders"}},
      options, f);
}

Options Parse(std::vector<std::string> arguments) {
  Options options;
  CLI::App app;
  AddOptions(&app, &options);
  std::reverse(arguments.begin(), arguments.end());
  app.parse(std::move(arguments));
  CheckRanges(options);
  return options;
}

std::string ErrorOf(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Options, ComeFromTheCommandLine) {
  const Options options = Parse({"--rate-hz", "20.5", "--count", "7", "--seed=-4", "--fast", "--only", "1,2",
                                 "--words", "x,y", "--folders", "a,b", "--folders", "c"});
  EXPECT_EQ(options.rate_hz, 20.5);
  EXPECT_EQ(options.count, 7);
  EXPECT_EQ(options.seed, -4);
  EXPECT_TRUE(options.fast);
  EXPECT_EQ(options.only, (std::vector<int>{1, 2}));
  EXPECT_EQ(options.words, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(options.folders, (std::vector<std::filesystem::path>{"a,b", "c"}));
}

TEST(InRange, RefusesNanAndWhatIsOutside) {
  const auto parse = [](const std::string& text) {
    CLI::App app;
    double share = 0;
    app.add_option("--share", share)->check(InRange(0, 1));
    app.parse(std::vector<std::string>{text, "--share"});
    return share;
  };
  EXPECT_EQ(parse("0"), 0);
  EXPECT_EQ(parse("1"), 1);
  for (const char* text : {"-0.1", "1.1", "nan", "-nan", "inf", "half"}) {
    EXPECT_THROW(parse(text), CLI::ValidationError) << text;
  }
}

TEST(Options, OutOfRangeIsReportedInTermsOfTheCommandLine) {
  EXPECT_EQ(ErrorOf([] { Parse({"--rate-hz", "600"}); }), "--rate-hz: expected 20 to 500, got 600");
  EXPECT_EQ(ErrorOf([] { Parse({"--rate-hz", "inf"}); }), "--rate-hz: expected 20 to 500, got inf");
  EXPECT_EQ(ErrorOf([] { Parse({"--rate-hz", "nan"}); }), "--rate-hz: expected 20 to 500, got nan");
  EXPECT_EQ(ErrorOf([] { Parse({"--count", "0"}); }), "--count: expected 1 or more, got 0");
  EXPECT_EQ(ErrorOf([] { Parse({"--only", "3,10"}); }), "--only: expected 0 to 9, got 10");
}

TEST(Options, SurviveJson) {
  Options options =
      Parse({"--rate-hz", "123.25", "--seed", "9007199254740993", "--fast", "--only", "4", "--folders", "x"});
  options.name = "\"quoted\"";
  Options read;
  ReadOptions(nlohmann::json::parse(OptionsJson(options).dump()), "run.json", &read);
  EXPECT_EQ(OptionsJson(read), OptionsJson(options));
  EXPECT_EQ(read.seed, 9007199254740993);
}

TEST(Options, AFileGoesBehindTheCommandLine) {
  TemporaryFolder folder;
  Options options;
  options.rate_hz = 100;
  options.count = 9;
  const std::string file = folder.path() / "run.json";
  std::ofstream(file) << OptionsJson(options);
  const Options read = Parse({"--count", "4", "--options", file});
  EXPECT_EQ(read.rate_hz, 100);
  EXPECT_EQ(read.count, 4);
  EXPECT_EQ(read.out, folder.path());
}

TEST(Options, WrongJsonIsNamedWithFileAndKey) {
  const auto read = [](const std::string& key, const nlohmann::json& value) {
    nlohmann::json json = OptionsJson(Options());
    if (value.is_null()) {
      json.erase(key);
    } else {
      json[key] = value;
    }
    return ErrorOf([&] {
      Options options;
      ReadOptions(json, "run.json", &options);
    });
  };
  EXPECT_EQ(read("count", nullptr), "run.json: count: required key is missing");
  EXPECT_EQ(read("count", 1.5), "run.json: count: expected a whole number, got 1.5");
  EXPECT_EQ(read("count", 4294967297),
            "run.json: count: expected a whole number of at most 32 bits, got 4294967297");
  EXPECT_EQ(read("count", -2147483649),
            "run.json: count: expected a whole number of at most 32 bits, got -2147483649");
  EXPECT_EQ(read("seed", 9223372036854775808u),
            "run.json: seed: expected a whole number of at most 64 bits, got 9223372036854775808");
  EXPECT_EQ(read("seed", INT64_MIN), "");
  EXPECT_EQ(read("only", {4294967297}), "run.json: only: expected a list of whole numbers, got [4294967297]");
  EXPECT_EQ(read("count", true), "run.json: count: expected a whole number, got true");
  EXPECT_EQ(read("rate_hz", "fast"), "run.json: rate_hz: expected a number, got \"fast\"");
  EXPECT_EQ(read("fast", 1), "run.json: fast: expected true or false, got 1");
  EXPECT_EQ(read("name", 1), "run.json: name: expected a string, got 1");
  EXPECT_EQ(read("words", "x"), "run.json: words: expected a list, got \"x\"");
  EXPECT_EQ(read("only", {1, 2.5}), "run.json: only: expected a list of whole numbers, got [1,2.5]");
  EXPECT_EQ(read("only", {true}), "run.json: only: expected a list of whole numbers, got [true]");
  EXPECT_EQ(read("rate_hz", 1e300), "--rate-hz: expected 20 to 500, got 1e+300");
}

TEST(Options, FixedKeysAreThoseOfTheTable) {
  EXPECT_EQ(FixedKeys(Options()), (std::vector<std::string>{"rate_hz", "seed"}));
}

TEST(Options, WithoutHelpTheyAreHidden) {
  Options options;
  CLI::App app;
  AddOptions(&app, &options);
  EXPECT_EQ(app.help().find("--name"), std::string::npos);
  EXPECT_NE(app.help().find("--rate-hz"), std::string::npos);
}

}  // namespace evalbus::options_test
