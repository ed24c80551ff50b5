// Tests live images over a real bus, of a run and of a replay, and rendering on machines without OSMesa.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "bus/channels.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"
#include "tests/unit/viz/decoded_jpeg.h"

namespace evalbus::viz_run_test {

namespace fs = std::filesystem;

// The messages that a subscriber receives on a bus until a program ends.
struct Received {
  std::map<std::string, std::vector<image_t>> images;
  std::vector<int64_t> state_tick;
  component_status_t viz{};
};

class VizRun : public testing::Test {
 protected:
  VizRun() {
    for (const char* channel : {"EVALBUS_IMAGE_overview", "EVALBUS_IMAGE_left_hand_wrist"}) {
      bus_.Subscribe(Channel<image_t>{channel, "viz"},
                     [this, channel](const image_t& m) { received_.images[channel].push_back(m); });
    }
    bus_.Subscribe(channels::kState,
                   [this](const state_t& m) { received_.state_tick.push_back(m.header.tick); });
    bus_.Subscribe(channels::kStatus, [this](const component_status_t& m) {
      if (m.component == "viz") received_.viz = m;
    });
  }

  bool ReceiveUntil(const std::function<bool()>& condition) {
    return WaitFor([&] {
      while (bus_.Handle()) {
      }
      return condition();
    });
  }
  bool AllShow(int64_t tick) const {
    return received_.viz.last_tick == tick && received_.images.size() == 2 &&
           std::ranges::all_of(received_.images,
                               [&](const auto& camera) { return camera.second.back().header.tick == tick; });
  }
  using Images = std::vector<image_t>;
  // Returns the index of the first image of the replay, whose ticks start at 0 again, or the number of images
  // if there is none.
  static size_t BeginAgain(const Images& images) {
    const auto earlier = [](const image_t& a, const image_t& b) { return b.header.tick < a.header.tick; };
    const auto last = std::ranges::adjacent_find(images, earlier);
    return last == images.end() ? images.size() : static_cast<size_t>(last - images.begin()) + 1;
  }
  // Expects that both cameras published decodable images in order, of ticks that were on the bus, and with at
  // most one replay.
  void ExpectImages() {
    EXPECT_EQ(received_.images.size(), 2u);
    for (const auto& [channel, images] : received_.images) {
      for (size_t i = 0; i < images.size(); ++i) {
        const image_t& image = images[i];
        if (i > 0 && i != BeginAgain(images)) {
          EXPECT_GE(image.header.tick, images[i - 1].header.tick);
        }
        EXPECT_NE(std::find(received_.state_tick.begin(), received_.state_tick.end(), image.header.tick),
                  received_.state_tick.end());
        EXPECT_EQ(image.header.sim_time_us, image.header.tick * 20000);
        EXPECT_EQ(image.view.width_px, 160);
        EXPECT_EQ(image.view.height_px, 120);
        const viz::Frame frame = viz::DecodedJpeg(image.data);
        EXPECT_EQ(frame.size.width, 160);
        EXPECT_EQ(frame.size.height, 120);
      }
    }
  }

  TemporaryFolder folder_;
  std::string url_ = UniqueUrl();
  Bus bus_{url_};
  Received received_;
  const std::vector<std::string> viz_ = {
      "evalbus-viz", "--url",   url_,    "--camera", "overview,left/hand/wrist",
      "--size",      "160x120", "--fps", "20"};
};

TEST_F(VizRun, ShowsARunAndItsReplayAlikeAndChangesNothing) {
  EVALBUS_NEEDS_BUS();
  const fs::path run = folder_.path() / "run";
  Program viz(viz_);
  // On a loaded machine, viz may start more slowly than the episode takes.
  ASSERT_TRUE(WaitFor([&] { return viz.out() == "viz ready\n"; })) << viz.err();
  Program evaluation({"evalbus", "run", ShortTask(folder_.path(), 3), "--policy", "hold", "--episodes", "1",
                      "--realtime", "--url", url_, "--out", run});
  ASSERT_TRUE(ReceiveUntil([&] { return !evaluation.running(); }));
  EXPECT_EQ(evaluation.Wait(), 0) << evaluation.err();
  // The last image shows the episode's end.
  const int64_t last = received_.state_tick.back();
  EXPECT_TRUE(ReceiveUntil([&] { return AllShow(last); }));
  EXPECT_GT(received_.viz.skipped_ticks, 0);
  EXPECT_EQ(received_.viz.missing_ticks, 0);
  EXPECT_TRUE(ReadLog(LogFile(run, 0)).Payloads("EVALBUS_IMAGE_overview").empty());

  // The same viz is still subscribed and renders the replay like the run. The last images are bit-identical.
  Program replay({"evalbus", "replay", run, "--url", url_});
  ASSERT_TRUE(ReceiveUntil([&] { return !replay.running(); }));
  EXPECT_EQ(replay.Wait(), 0) << replay.out() << replay.err();
  const Images& images = received_.images["EVALBUS_IMAGE_overview"];
  ASSERT_TRUE(ReceiveUntil([&] { return BeginAgain(images) < images.size() && AllShow(last); }));
  const image_t end_of_run = images[BeginAgain(images) - 1];
  EXPECT_EQ(end_of_run.header.tick, last);
  // The result is drawn onto the image of that tick as soon as it is known.
  EXPECT_TRUE(ReceiveUntil([&] { return images.back().data == end_of_run.data; }));
  ExpectImages();
  viz.Signal(SIGTERM);
  EXPECT_EQ(viz.Wait(), 0) << viz.err();
}

TEST_F(VizRun, MayComeInTheMiddleOfARunByItsFolder) {
  EVALBUS_NEEDS_BUS();
  const fs::path run = folder_.path() / "run";
  // The episode takes longer than the start of a renderer on a loaded machine. The run ends with this test.
  Program evaluation({"evalbus", "run", ShortTask(folder_.path(), 3600), "--policy", "hold", "--episodes",
                      "1", "--realtime", "--url", url_, "--out", run});
  ASSERT_TRUE(ReceiveUntil([&] { return received_.state_tick.size() > 20; })) << evaluation.err();
  std::vector<std::string> command = viz_;
  command.erase(command.begin() + 1, command.begin() + 3);
  command.push_back(run);
  Program viz(command);
  ASSERT_TRUE(ReceiveUntil([&] { return received_.images["EVALBUS_IMAGE_overview"].size() > 0; }))
      << viz.err() << evaluation.out();
  EXPECT_TRUE(evaluation.running());
  EXPECT_GT(received_.images["EVALBUS_IMAGE_overview"][0].header.tick, 20);
  EXPECT_EQ(received_.viz.missing_ticks, 0);
}

TEST_F(VizRun, UnknownCameraIsOneLineAndInTheStatus) {
  EVALBUS_NEEDS_BUS();
  Program viz({"evalbus-viz", "--url", url_, "--camera", "overview,nowhere"});
  ASSERT_TRUE(WaitFor([&] { return viz.out() == "viz ready\n"; })) << viz.err();
  Program evaluation({"evalbus", "run", ShortTask(folder_.path(), 1), "--policy", "hold", "--episodes", "1",
                      "--url", url_, "--out", folder_.path() / "run"});
  ASSERT_TRUE(ReceiveUntil([&] { return !viz.running() && !evaluation.running(); }));
  EXPECT_EQ(viz.Wait(), 1);
  const std::string line =
      "no camera 'nowhere'; this scene has head, roboeval/external, front, overview, roboeval/head, "
      "roboeval/front, roboeval/left_wrist, left/hand/wrist, roboeval/right_wrist, right/hand/wrist";
  EXPECT_EQ(viz.err(), "error: " + line + "\n");
  EXPECT_EQ(received_.viz.state, component_status_t::FAILED);
  EXPECT_EQ(received_.viz.error, line);
  EXPECT_EQ(evaluation.Wait(), 0) << evaluation.err();
}

TEST(VizInput, WrongInputIsOneLine) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--size", "640"}, "--size 640: expected WIDTHxHEIGHT, for example 1280x720"},
      {{"--size", "4294967936x480"}, "--size 4294967936x480: expected WIDTHxHEIGHT, for example 1280x720"},
      {{"--size", "641x480"}, "images of 641x480: expected even numbers of pixels, 2 to 4096 per side"},
      {{"--fps", "0"}, "--fps: expected a number above 0, got 0"},
      {{"--gl", "metal"}, "--gl metal: expected software, osmesa, egl-software, egl or auto"},
      {{"/nonexistent"}, "/nonexistent: no such run folder"},
  };
  for (const auto& [arguments, line] : cases) {
    std::vector<std::string> command = {"evalbus-viz"};
    if (arguments.size() == 2) command.insert(command.end(), {"--url", UniqueUrl()});
    command.insert(command.end(), arguments.begin(), arguments.end());
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "error: " + line + "\n");
  }
}

// Simulates a machine without OSMesa. In the child, the loader does not find the library.
class WithoutOsMesa : public testing::Test {
 protected:
  static Result Run(std::vector<std::string> command, bool with_egl) {
    return RunProgram(std::move(command), {{}, [=] {
                                             setenv("LD_AUDIT", HIDE_RENDERERS, 1);
                                             if (!with_egl) setenv("HIDE_EGL", "1", 1);
                                             // Reserves room for the thread-local variables of a thread
                                             // sanitizer. With LD_AUDIT the loader reserves too little.
                                             setenv("GLIBC_TUNABLES",
                                                    "glibc.rtld.optional_static_tls=1000000", 1);
                                           }});
  }
  // The error line without EGL. The loader's message follows in parentheses.
  static std::string Line() {
    return "error: rendering requires OSMesa or EGL: 'apt-get install libosmesa6' or 'apt-get install "
           "libegl1' "
           "(";
  }
  static void ExpectLine(const std::string& text, const std::string& line) {
    EXPECT_TRUE(text.starts_with(line)) << text;
    EXPECT_NE(text.find("No such file"), std::string::npos) << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  }

  TemporaryFolder folder_;
};

TEST_F(WithoutOsMesa, ARunRendersTheSameBytesWithEgl) {
  std::string videos[2];
  for (const bool has_osmesa : {true, false}) {
    const fs::path run = folder_.path() / (has_osmesa ? "with" : "without");
    const std::vector<std::string> command = {"evalbus",  "run",          ShortTask(folder_.path(), 0.2),
                                              "--policy", "hold",         "--episodes",
                                              "1",        "--in-process", "--video",
                                              "front",    "--out",        run};
    const Result result = has_osmesa ? RunProgram(command) : Run(command, true);
    EXPECT_EQ(result.code, 0) << result.err;
    const nlohmann::json json = nlohmann::json::parse(ReadText(run / "run.json"));
    const std::string gl = has_osmesa ? "osmesa" : "egl-software";
    EXPECT_EQ(json["gl"], gl);
    EXPECT_TRUE(json["renderer"].get<std::string>().starts_with(gl + " (llvmpipe")) << json["renderer"];
    videos[has_osmesa] = ReadText(run / "episodes/0000/front.mp4");
  }
  EXPECT_GT(videos[0].size(), 1000u);
  EXPECT_TRUE(videos[0] == videos[1]);
  // This command has no option --gl.
  const Result result = Run({"evalbus", "report", folder_.path() / "with"}, true);
  EXPECT_EQ(result.code, 0) << result.err;
}

TEST_F(WithoutOsMesa, VizAndRenderNameThePackagesToInstall) {
  const fs::path run = folder_.path() / "run";
  const std::string task = ShortTask(folder_.path(), 0.2);
  Evaluate({task, "--policy", "hold", "--episodes", "1", "--in-process"}, run);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"evalbus", "render", run}, {"evalbus-viz", "--url", UniqueUrl()}}) {
    const Result result = Run(command, false);
    EXPECT_EQ(result.code, 2);
    EXPECT_EQ(result.out, "");
    ExpectLine(result.err, Line());
  }
  const auto episode = fs::directory_iterator(run / "episodes/0000");
  EXPECT_TRUE(std::none_of(begin(episode), end(episode),
                           [](const auto& entry) { return entry.path().extension() == ".mp4"; }));
  const Result egl = Run({"evalbus", "render", run}, true);
  EXPECT_EQ(egl.code, 0) << egl.err;
  EXPECT_TRUE(egl.err.starts_with("renders with egl-software (llvmpipe")) << egl.err;
  EXPECT_TRUE(WithoutProgress(egl.err).ends_with("): OSMesa is not installed\n")) << egl.err;
}

TEST_F(WithoutOsMesa, ARunThatDrawsEndsBeforeItsFirstEpisode) {
  const fs::path run = folder_.path() / "run";
  const Result result = Run({"evalbus", "run", ShortTask(folder_.path(), 0.2), "--policy", "hold",
                             "--episodes", "2", "--in-process", "--video", "front", "--out", run},
                            false);
  EXPECT_EQ(result.code, 2);
  ExpectLine(result.err, Line());
  EXPECT_FALSE(fs::exists(run / "episodes.jsonl"));
}

TEST_F(WithoutOsMesa, DoctorReportsIt) {
  const Result egl = Run({"evalbus", "doctor"}, true);
  EXPECT_NE(egl.out.find("ok    software rendering of images and videos: egl-software (llvmpipe"),
            std::string::npos)
      << egl.out;
  const Result none = Run({"evalbus", "doctor"}, false);
  EXPECT_NE(none.out.find("FAIL  software rendering of images and videos\n"
                          "      fix: rendering requires OSMesa or EGL: 'apt-get install libosmesa6'"),
            std::string::npos)
      << none.out;
}

}  // namespace evalbus::viz_run_test
