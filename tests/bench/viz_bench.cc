// Measures frames per second on one core at 640x480 with shadows (target: 25). Also measures the cost of one
// of our frames, ready for encoding, relative to drawing and reading the same scene with only MuJoCo and
// OSMesa (target: 1.2 times). The same comparison follows for the three 224x224 images of a policy, from
// REQUEST_IMAGE to the last IMAGE.
#include <GL/osmesa.h>
#include <benchmark/benchmark.h>
#include <sched.h>
#include <time.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/camera_component.h"
#include "viz/images/overlay.h"
#include "viz/images/renderer.h"
#include "viz/viz_component.h"

namespace evalbus {
namespace {

constexpr viz::FrameSize kSize{640, 480};
// Size at which Renderer draws an image of kSize before it scales the image down.
constexpr mjrRect kDrawn{0, 0, 960, 720};

// Returns the CPU time of all threads of this process, because Mesa may draw in its own threads.
double CpuSeconds() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

viz::OverlayText Text() {
  viz::OverlayText text;
  text.title = "lift_pot/position";
  text.subtitle = "episode 3, seed 1234567890";
  text.stages = {
      {"left_gripper_touches_pot", true}, {"right_gripper_touches_pot", true}, {"pot_lifted", false}};
  text.counts = {{"slips", 2}, {"collisions with the scene", 0}, {"self collisions", 0}};
  return text;
}

// Draws with MuJoCo and OSMesa only.
struct Bare {
  Bare(const mjModel& visual, const std::vector<double>& qpos, int width, int height)
      : model(viz::Copy(visual)), rgb(static_cast<size_t>(width * height) * 3) {
    model->vis.global.offwidth = width;
    model->vis.global.offheight = height;
    model->vis.quality.offsamples = 0;
    data.reset(mj_makeData(model.get()));
    Move(qpos);
    MakeCurrent();
    mjv_defaultScene(&scene);
    mjr_defaultContext(&context);
    mjv_defaultOption(&option);
    mjv_defaultCamera(&view);
    mjv_makeScene(model.get(), &scene, 2000);
    mjr_makeContext(model.get(), &context, mjFONTSCALE_50);
    mjr_setBuffer(mjFB_OFFSCREEN, &context);
    view.type = mjCAMERA_FIXED;
  }
  ~Bare() {
    MakeCurrent();
    mjr_freeContext(&context);
    mjv_freeScene(&scene);
    OSMesaDestroyContext(mesa);
  }
  void MakeCurrent() { OSMesaMakeCurrent(mesa, unused.data(), GL_UNSIGNED_BYTE, 4, 4); }
  void Move(const std::vector<double>& qpos) {
    std::copy(qpos.begin(), qpos.end(), data->qpos);
    mj_forward(model.get(), data.get());
  }
  // Draws into rgb or, if given, into depth.
  void Draw(int camera, mjrRect rect, float* depth = nullptr) {
    MakeCurrent();
    view.fixedcamid = camera;
    mjv_updateScene(model.get(), data.get(), &option, nullptr, &view, mjCAT_ALL, &scene);
    mjr_render(rect, &scene, &context);
    mjr_readPixels(depth ? nullptr : rgb.data(), depth, rect, &context);
  }

  ModelPtr model;
  DataPtr data;
  OSMesaContext mesa = OSMesaCreateContextExt(OSMESA_RGBA, 24, 8, 0, nullptr);
  std::vector<uint8_t> unused = std::vector<uint8_t>(64), rgb;
  mjvScene scene;
  mjrContext context;
  mjvOption option;
  mjvCamera view;
};

// Returns joint positions as in an episode, in which the renderer does not redraw stationary parts. Every
// joint of both arms rotates by at most a degree from image to image.
std::vector<double> QposAt(const mjModel& model, int image) {
  std::vector<double> qpos = viz::HomeQpos(model);
  for (int joint = 0; joint < model.njnt; ++joint) {
    if (model.jnt_type[joint] != mjJNT_HINGE) continue;
    qpos[static_cast<size_t>(model.jnt_qposadr[joint])] += 0.2 * std::sin(0.08 * image + joint);
  }
  return qpos;
}

// Draws our frames as they are passed to the encoder, alternately with bare ones.
void Frames(benchmark::State& state, const char* camera_name) {
  const Scene scene = viz::LiftPotScene();
  const int camera = viz::FindCamera(*scene.visual, camera_name);

  viz::Renderer renderer(viz::Copy(*scene.visual), kSize);
  const viz::Overlay overlay(kSize);
  const viz::OverlayText text = Text();
  viz::Frame frame(kSize);

  Bare bare(*scene.visual, QposAt(*scene.visual, 0), kDrawn.width, kDrawn.height);
  state_t shown = viz::StateOf(QposAt(*scene.visual, 0));
  const auto draw_ours = [&] {
    renderer.SetState(shown);
    renderer.Render(camera, &frame);
    overlay.Draw(text, &frame);
  };
  const auto draw_bare = [&] { bare.Draw(camera, kDrawn); };
  draw_ours();
  draw_bare();
  double ours = 0, others = 0;
  int image = 0;
  for (auto _ : state) {
    const std::vector<double> qpos = QposAt(*scene.visual, ++image);
    shown.qpos_mixed = qpos;
    bare.Move(qpos);
    const double begin = CpuSeconds();
    draw_ours();
    const double middle = CpuSeconds();
    draw_bare();
    ours += middle - begin;
    others += CpuSeconds() - middle;
    state.SetIterationTime(middle - begin);
  }

  // Both images must show the same scene, so the mean color of the middle third, which no overlay covers, is
  // compared.
  double mean[2] = {0, 0};
  for (int row = 160; row < 320; ++row) {
    for (int column = 213; column < 427; ++column) {
      for (int c = 0; c < 3; ++c) mean[0] += frame.bgrx[static_cast<size_t>((row * 640 + column) * 4 + c)];
    }
  }
  for (int row = 240; row < 480; ++row) {
    for (int column = 320; column < 640; ++column) {
      for (int c = 0; c < 3; ++c) mean[1] += bare.rgb[static_cast<size_t>((row * 960 + column) * 3 + c)];
    }
  }
  mean[0] /= 160 * 214 * 3;
  mean[1] /= 240 * 320 * 3;
  if (mean[0] < 20 || std::abs(mean[0] - mean[1]) > 2) state.SkipWithError("the images differ");

  const double frames = static_cast<double>(state.iterations());
  state.counters["fps_one_core"] = frames / ours;
  state.counters["fps_limit"] = 25;
  state.counters["ratio_to_bare"] = ours / others;
  state.counters["ratio_limit"] = 1.2;
}
BENCHMARK_CAPTURE(Frames, front, "front")->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Frames, head, "head")->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Frames, overview, "overview")->UseManualTime()->Unit(benchmark::kMillisecond);

// Draws a policy's three images of a STATE, alternately with bare ones that have the same number of drawn
// pixels.
void Observations(benchmark::State& state, const char* encoding, bool shadows) {
  constexpr int kSide = 224;
  const bool is_depth = std::string_view(encoding) == "depth32";
  const Scene scene = viz::LiftPotScene();
  const std::vector<double> home = QposAt(*scene.visual, 0);
  const TemporaryFolder folder;
  Bus bus("memq://");
  viz::CameraComponent component(&bus);
  std::vector<image_t> images;
  image_request_t request{};
  for (const char* camera : {"roboeval/head", "roboeval/left_wrist", "roboeval/right_wrist"}) {
    view_t view{};
    view.camera = camera;
    view.width_px = view.height_px = kSide;
    view.shadows = shadows;
    view.encoding = encoding;
    request.view.push_back(view);
    const std::string channel = channels::ImageChannel(camera);
    bus.Subscribe(Channel<image_t>{channel.c_str(), "cameras"},
                  [&](const image_t& image) { images.push_back(image); });
  }
  request.num_views = static_cast<int32_t>(request.view.size());
  const auto handle = [&bus] {
    while (bus.Handle()) {
    }
  };
  bus.Publish(channels::kModel, viz::VisualInfo(folder.path(), *scene.visual));
  bus.Publish(channels::kEpisodeBegin, episode_begin_t{});
  handle();
  state_t shown = viz::StateOf(home);
  const auto draw_ours = [&] {
    images.clear();
    bus.Publish(channels::kState, shown);
    request.header = shown.header;
    bus.Publish(channels::kRequestImage, request);
    handle();
    ++shown.header.tick;
  };

  // Color images are drawn 1.5 times as large in each direction.
  const int drawn = is_depth ? kSide : kSide * 3 / 2;
  Bare bare(*scene.visual, home, drawn, drawn);
  bare.scene.flags[mjRND_SHADOW] = shadows && !is_depth;
  bare.scene.flags[mjRND_SEGMENT] = is_depth;
  std::vector<float> depth(static_cast<size_t>(drawn * drawn));
  const auto draw_bare = [&] {
    for (const view_t& view : request.view) {
      bare.Draw(viz::FindCamera(*scene.visual, view.camera), {0, 0, drawn, drawn},
                is_depth ? depth.data() : nullptr);
    }
  };
  draw_ours();
  draw_bare();
  double ours = 0, others = 0;
  for (auto _ : state) {
    const std::vector<double> qpos = QposAt(*scene.visual, static_cast<int>(shown.header.tick));
    shown.qpos_mixed = qpos;
    bare.Move(qpos);
    const double begin = CpuSeconds();
    draw_ours();
    const double middle = CpuSeconds();
    draw_bare();
    ours += middle - begin;
    others += CpuSeconds() - middle;
    state.SetIterationTime(middle - begin);
  }

  // All images of this tick have been received. The last one has the same brightness or depth as the bare
  // image.
  const size_t bytes = static_cast<size_t>(kSide * kSide) * (is_depth ? sizeof(float) : 3);
  bool is_good = images.size() == 3;
  for (const image_t& image : images) {
    is_good &= image.header.tick == shown.header.tick - 1 && image.data.size() == bytes;
  }
  if (is_good && !is_depth) {
    const auto mean = [](const std::vector<uint8_t>& rgb) {
      return std::accumulate(rgb.begin(), rgb.end(), 0.0) / static_cast<double>(rgb.size());
    };
    is_good = mean(bare.rgb) > 20 && std::abs(mean(images[2].data) - mean(bare.rgb)) < 2;
  } else if (is_good) {
    const double near = bare.scene.camera[0].frustum_near, far = bare.scene.camera[0].frustum_far;
    std::vector<float> meters(depth.size());
    std::memcpy(meters.data(), images[2].data.data(), bytes);
    const size_t middle = static_cast<size_t>(kSide * kSide / 2);
    is_good = std::abs(meters[middle] - near / (1 - depth[middle] * (1 - near / far))) < 0.01;
  }
  if (!is_good) state.SkipWithError("not the images that were asked for");

  const double rounds = static_cast<double>(state.iterations());
  state.counters["images_per_s"] = 3 * rounds / ours;
  state.counters["ratio_to_bare"] = ours / others;
}
BENCHMARK_CAPTURE(Observations, rgb8, "rgb8", true)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Observations, rgb8_no_shadows, "rgb8", false)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Observations, depth32, "depth32", false)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  // Restricts the process to one core.
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  sched_setaffinity(0, sizeof one, &one);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
