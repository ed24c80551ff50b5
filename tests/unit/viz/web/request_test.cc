// Tests which requests are allowed, and from which origins.
#include "viz/web/request.h"

#include <gtest/gtest.h>

namespace evalbus::viz::request_test {

using Kind = WebTarget::Kind;

TEST(WebRequest, KnowsItsTargets) {
  EXPECT_EQ(ParseTarget("/", "").kind, Kind::kPage);
  EXPECT_EQ(ParseTarget("/?x=/live", "").kind, Kind::kPage);
  EXPECT_EQ(ParseTarget("/live", "").kind, Kind::kLive);
  const WebTarget file = ParseTarget("/page/three.module.js?v=2", "");
  EXPECT_EQ(file.kind, Kind::kPageFile);
  EXPECT_EQ(file.name, "three.module.js");
  const std::string id(64, 'a');
  const WebTarget block = ParseTarget("/block/" + id, "");
  EXPECT_EQ(block.kind, Kind::kBlock);
  EXPECT_EQ(block.name, id);
  const WebTarget episode = ParseTarget("/episode/3/12", "");
  EXPECT_EQ(episode.kind, Kind::kEpisode);
  EXPECT_EQ(episode.run, 3);
  EXPECT_EQ(episode.episode, 12);
}

TEST(WebRequest, NothingElseIsThere) {
  const std::string targets[] = {"",
                                 "live",
                                 "//",
                                 "/page/",
                                 "/page/..",
                                 "/page/../server.cc",
                                 "/page/a/b.js",
                                 "/page/.hidden",
                                 "/page/a%2e.js",
                                 "/page/" + std::string(65, 'a'),
                                 "/page/a\\b",
                                 std::string("/page/a\0b", 9),
                                 "/block/" + std::string(63, 'a'),
                                 "/block/" + std::string(64, 'A'),
                                 "/block/" + std::string(64, '/'),
                                 "/episode/1",
                                 "/episode/1/",
                                 "/episode/-1/0",
                                 "/episode/1/2/3",
                                 "/episode/99999999999/0",
                                 "/episode/1/0x1",
                                 "/live/",
                                 "/etc/passwd",
                                 "http://127.0.0.1/",
                                 "*"};
  for (const std::string& target : targets) EXPECT_EQ(ParseTarget(target, "").kind, Kind::kNone) << target;
}

TEST(WebRequest, WithATokenNothingIsThereWithoutIt) {
  EXPECT_EQ(ParseTarget("/secret/", "secret").kind, Kind::kPage);
  EXPECT_EQ(ParseTarget("/secret/live", "secret").kind, Kind::kLive);
  for (const char* target : {"/", "/live", "/secret", "/secre/", "/secrets/live", "/Secret/live", "//live",
                             "/secret//", "/?token=secret"}) {
    EXPECT_EQ(ParseTarget(target, "secret").kind, Kind::kNone) << target;
  }
}

TEST(WebRequest, SameTextIsTheSameTextOnly) {
  EXPECT_TRUE(SameText("abc", "abc"));
  EXPECT_TRUE(SameText("", ""));
  for (const char* other : {"", "ab", "abcd", "abd", "xbc", "abcabc"})
    EXPECT_FALSE(SameText(other, "abc")) << other;
  EXPECT_FALSE(SameText("aa", "a"));
  EXPECT_FALSE(SameText("a", ""));
}

TEST(WebRequest, OnlyLoopbackNamesAreHosts) {
  for (const char* host : {"127.0.0.1:8080", "localhost:1", "[::1]:65535", "127.0.0.1", "localhost"}) {
    EXPECT_TRUE(IsLoopbackHost(host)) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:8080", "localhost.evil.example",
                           "127.0.0.1.evil.example", "localhost:", "localhost:0", "localhost:65536",
                           "localhost:8080:1", "::1", "127.0.0.1:80a", "user@localhost"}) {
    EXPECT_FALSE(IsLoopbackHost(host)) << host;
  }
}

TEST(WebRequest, OnlyPagesOfOursMayListen) {
  EXPECT_TRUE(IsOwnOrigin("", "localhost:8080"));
  EXPECT_TRUE(IsOwnOrigin("http://localhost:8080", "localhost:8080"));
  for (const char* origin :
       {"null", "http://evil.example", "http://localhost:8081", "https://localhost:8080",
        "http://localhost:8080/", "http://localhost:8080.evil.example", "http://", "file://"}) {
    EXPECT_FALSE(IsOwnOrigin(origin, "localhost:8080")) << origin;
  }
  EXPECT_FALSE(IsOwnOrigin("http://", ""));
}

TEST(WebRequest, APageSendsOnlyTheRunThatItWatches) {
  EXPECT_EQ(ParseWatch(R"({"watch": 3})"), 3);
  for (const char* text : {"", "{", "[]", "3", R"({"watch": -1})", R"({"watch": 1.5})", R"({"watch": "1"})",
                           R"({"watch": 1, "more": 2})", R"({"look": 1})", R"({"watch": 1000001})", "null",
                           R"({"watch": 18446744073709551615})", "{\"watch\": 1}\xff"}) {
    EXPECT_EQ(ParseWatch(text), std::nullopt) << text;
  }
}

TEST(WebRequest, NotesAreParsedStrictly) {
  const auto note = ParseNote(R"({"note": {"run": 2, "episode": 7, "text": "odd \"start\""}})");
  ASSERT_TRUE(note);
  EXPECT_EQ(note->run, 2);
  EXPECT_EQ(note->episode, 7);
  EXPECT_EQ(note->text, "odd \"start\"");
  for (const char* other : {"", "{}", "[]", R"({"note": 1})", R"({"note": {"run": 2, "episode": 7}})",
                            R"({"note": {"run": 2, "episode": 7, "text": 1}})",
                            R"({"note": {"run": -2, "episode": 7, "text": "a"}})",
                            R"({"note": {"run": 2, "episode": "7", "text": "a"}})",
                            R"({"note": {"run": 2, "episode": 7.5, "text": "a"}})",
                            R"({"note": {"run": 2, "episode": 99999999999, "text": "a"}})",
                            R"({"note": {"run": 2, "episode": 7, "text": "a", "file": "b"}})",
                            R"({"note": {"run": 2, "episode": 7, "text": "a"}, "watch": 0})",
                            "{\"note\": {\"run\": 2, \"episode\": 7, \"text\": \"\xff\"}}"}) {
    EXPECT_FALSE(ParseNote(other)) << other;
  }
}

TEST(WebRequest, VerdictsAreParsedStrictly) {
  const std::string whole =
      R"({"verdict": {"episode": 7, "outcome": "success", "stages": 2, "rubric": 7.5}})";
  const auto verdict = ParseVerdict(whole);
  ASSERT_TRUE(verdict);
  EXPECT_EQ(verdict->episode, 7);
  EXPECT_EQ(verdict->outcome, "success");
  EXPECT_EQ(verdict->stages, 2);
  EXPECT_EQ(verdict->rubric, 7.5);
  const auto shortest =
      ParseVerdict(R"({"verdict": {"episode": 0, "outcome": "abstain", "stages": null, "rubric": null}})");
  ASSERT_TRUE(shortest);
  EXPECT_EQ(shortest->stages, std::nullopt);
  EXPECT_EQ(shortest->rubric, std::nullopt);
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"7,", "-7,"},
                                 {"7,", "\"7\","},
                                 {"7,", "99999999999,"},
                                 {"success", "good"},
                                 {"\"success\"", "true"},
                                 {"2", "-2"},
                                 {"2", "2.5"},
                                 {"2", "5000"},
                                 {"7.5", "10.1"},
                                 {"7.5", "-1"},
                                 {"7.5", "\"7\""},
                                 {"stages", "steps"},
                                 {"\"rubric\"", "\"file\": 1, \"rubric\""}}) {
    std::string other = whole;
    other.replace(other.find(from), from.size(), to);
    EXPECT_FALSE(ParseVerdict(other)) << other;
  }
  for (const char* other : {"", "{}", "[]", R"({"verdict": 1})"}) EXPECT_FALSE(ParseVerdict(other)) << other;
}

}  // namespace evalbus::viz::request_test
