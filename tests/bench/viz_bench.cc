// Frames per second on one core at 640x480 with shadows (target: 25), and the cost of a frame of ours, ready
// to be encoded, against drawing and reading the same scene with nothing but MuJoCo and OSMesa (target: 1.2
// times).
#include <GL/osmesa.h>
#include <benchmark/benchmark.h>
#include <sched.h>
#include <time.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "tests/unit/viz/viz_scene.h"
#include "viz/pictures/overlay.h"
#include "viz/pictures/renderer.h"

namespace evalbus {
namespace {

constexpr viz::FrameSize kSize{640, 480};
// What Renderer draws for a picture of that size.
constexpr mjrRect kDrawn{0, 0, 960, 720};

// Of all threads of this process: Mesa draws in threads of its own.
double CpuSeconds() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

viz::OverlayText Text() {
  viz::OverlayText text;
  text.title = "lift_pot/position";
  text.subtitle = "episode 3, seed 1234567890";
  text.stages = {{"left_gripper_holds_pot", true}, {"right_gripper_holds_pot", true}, {"pot_lifted", false}};
  text.counts = {{"slips", 2}, {"collisions with the scene", 0}, {"self collisions", 0}};
  return text;
}

// Our own frames as they go to the encoder, taken in turns with bare ones.
void Frames(benchmark::State& state, const char* camera_name) {
  const Scene scene = viz::LiftPotScene();
  std::vector<double> qpos = viz::HomeQpos(*scene.visual);
  const int camera = viz::FindCamera(*scene.visual, camera_name);

  viz::Renderer renderer(viz::Copy(*scene.visual), kSize);
  const viz::Overlay overlay(kSize);
  const viz::OverlayText text = Text();
  viz::Frame frame(kSize);

  ModelPtr model = viz::Copy(*scene.visual);
  model->vis.global.offwidth = kDrawn.width;
  model->vis.global.offheight = kDrawn.height;
  model->vis.quality.offsamples = 0;
  mjData* data = mj_makeData(model.get());
  std::copy(qpos.begin(), qpos.end(), data->qpos);
  mj_forward(model.get(), data);
  OSMesaContext mesa = OSMesaCreateContextExt(OSMESA_RGBA, 24, 8, 0, nullptr);
  std::vector<uint8_t> unused(64), rgb(static_cast<size_t>(kDrawn.width * kDrawn.height) * 3);
  const auto make_current = [&] { OSMesaMakeCurrent(mesa, unused.data(), GL_UNSIGNED_BYTE, 4, 4); };
  make_current();
  mjvScene bare;
  mjrContext context;
  mjvOption option;
  mjvCamera view;
  mjv_defaultScene(&bare);
  mjr_defaultContext(&context);
  mjv_defaultOption(&option);
  mjv_defaultCamera(&view);
  mjv_makeScene(model.get(), &bare, 2000);
  mjr_makeContext(model.get(), &context, mjFONTSCALE_50);
  mjr_setBuffer(mjFB_OFFSCREEN, &context);
  view.type = mjCAMERA_FIXED;
  view.fixedcamid = camera;
  mjv_updateScene(model.get(), data, &option, nullptr, &view, mjCAT_ALL, &bare);

  const state_t shown = viz::StateOf(qpos);
  const auto draw_ours = [&] {
    renderer.SetState(shown);
    renderer.Render(camera, &frame);
    overlay.Draw(text, &frame);
  };
  const auto draw_bare = [&] {
    make_current();
    mjr_render(kDrawn, &bare, &context);
    mjr_readPixels(rgb.data(), nullptr, kDrawn, &context);
  };
  draw_ours();
  draw_bare();
  double ours = 0, others = 0;
  for (auto _ : state) {
    const double begin = CpuSeconds();
    draw_ours();
    const double middle = CpuSeconds();
    draw_bare();
    ours += middle - begin;
    others += CpuSeconds() - middle;
    state.SetIterationTime(middle - begin);
  }

  // Both show the same: the mean colour of the middle third, which no overlay covers.
  double mean[2] = {0, 0};
  for (int row = 160; row < 320; ++row) {
    for (int column = 213; column < 427; ++column) {
      for (int c = 0; c < 3; ++c) mean[0] += frame.bgrx[static_cast<size_t>((row * 640 + column) * 4 + c)];
    }
  }
  for (int row = 240; row < 480; ++row) {
    for (int column = 320; column < 640; ++column) {
      for (int c = 0; c < 3; ++c) mean[1] += rgb[static_cast<size_t>((row * 960 + column) * 3 + c)];
    }
  }
  mean[0] /= 160 * 214 * 3;
  mean[1] /= 240 * 320 * 3;
  if (mean[0] < 20 || std::abs(mean[0] - mean[1]) > 2) state.SkipWithError("the pictures differ");

  const double frames = static_cast<double>(state.iterations());
  state.counters["fps_one_core"] = frames / ours;
  state.counters["fps_limit"] = 25;
  state.counters["ratio_to_bare"] = ours / others;
  state.counters["ratio_limit"] = 1.2;

  mjr_freeContext(&context);
  mjv_freeScene(&bare);
  mj_deleteData(data);
  OSMesaDestroyContext(mesa);
}
BENCHMARK_CAPTURE(Frames, front, "front")->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Frames, head, "head")->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Frames, overview, "overview")->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  // One core for Mesa's threads and ours.
  setenv("LP_NUM_THREADS", "1", 1);
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  sched_setaffinity(0, sizeof one, &one);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
