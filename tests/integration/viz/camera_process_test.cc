// Tests the process that renders the images that a policy requests. Complete images arrive over a real bus
// and equal those that the same component renders in this process. The test acts as sim and policy.
#include <map>

#include "bus/channels.h"
#include "evalbus/component_status_t.hpp"
#include "tests/integration/harness.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/camera_component.h"
#include "viz/viz_component.h"

namespace evalbus::camera_process_test {

class CameraProcess : public testing::Test {
 protected:
  // Images by camera name.
  using Images = std::map<std::string, image_t>;

  CameraProcess() {
    for (const auto& [camera, side] :
         {std::pair{"roboeval/head", 224}, {"front", 512}, {"left/hand/wrist", 65}}) {
      view_t view{};
      view.camera = camera;
      view.width_px = view.height_px = side;
      view.shadows = 1;
      view.encoding = side == 512 ? "depth32" : "rgb8";
      image_request_.view.push_back(view);
    }
    image_request_.num_views = 3;
    state_ = viz::StateOf(viz::HomeQpos(*scene_.visual));
    image_request_.header.tick = state_.header.tick = 0;
  }

  void Receive(Bus* bus, Images* images) {
    for (const view_t& view : image_request_.view) {
      const std::string channel = channels::ImageChannel(view.camera);
      bus->Subscribe(Channel<image_t>{channel.c_str(), "cameras"},
                     [images](const image_t& m) { (*images)[m.view.camera] = m; });
    }
    bus->Subscribe(channels::kStatus, [this](const component_status_t& m) { status_ = m; });
  }
  bool ReceiveUntil(Bus* bus, const std::function<bool()>& condition) {
    return WaitFor([&] {
      while (bus->Handle()) {
      }
      return condition();
    });
  }
  void Begin(Bus* bus) {
    bus->Publish(channels::kModel, model_);
    bus->Publish(channels::kEpisodeBegin, episode_begin_t{});
  }

  TemporaryFolder folder_;
  const Scene scene_ = viz::LiftPotScene();
  // The model is written only once, because a process may be reading the file when the model is announced
  // again.
  const model_info_t model_ = viz::VisualInfo(folder_.path(), *scene_.visual);
  state_t state_{};
  image_request_t image_request_{};
  component_status_t status_{};
};

TEST_F(CameraProcess, GivesTheBytesOfTheComponentInThisProcess) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl();
  Bus bus(url), bystander(url);
  Images far, near;
  Receive(&bus, &far);
  int states_received = 0;
  bystander.Subscribe(channels::kState, [&](const state_t&) { ++states_received; });
  Program process({"evalbus-viz", "--answer-image-requests", "--url", url});
  ASSERT_TRUE(ReceiveUntil(&bus, [&] {
    if (status_.state != component_status_t::READY) Begin(&bus);
    return status_.state == component_status_t::READY;
  })) << process.err();
  EXPECT_EQ(status_.component, "cameras");
  // A request before its STATE is held until the STATE arrives.
  bus.Publish(channels::kRequestImage, image_request_);
  bus.Publish(channels::kState, state_);
  ASSERT_TRUE(ReceiveUntil(&bus, [&] { return far.size() == 3; }));

  Bus own("memq://");
  Receive(&own, &near);
  viz::CameraComponent component(&own);
  Begin(&own);
  own.Publish(channels::kState, state_);
  own.Publish(channels::kRequestImage, image_request_);
  ASSERT_TRUE(ReceiveUntil(&own, [&] { return near.size() == 3; }));
  for (const view_t& view : image_request_.view) {
    EXPECT_EQ(far[view.camera].view.width_px, view.width_px);
    EXPECT_TRUE(far[view.camera].data == near[view.camera].data) << view.camera;
  }
  // A depth image of 1 MB arrives completely. Processes that did not request it lose no message.
  EXPECT_EQ(far["front"].data.size(), 512u * 512 * 4);
  while (bystander.Handle()) {
  }
  EXPECT_EQ(states_received, 1);
  EXPECT_EQ(bystander.decode_errors(), 0);
  EXPECT_EQ(bus.decode_errors(), 0);
}

TEST_F(CameraProcess, AnUnknownCameraIsOneLine) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl();
  Bus bus(url);
  Images images;
  Receive(&bus, &images);
  Program process({"evalbus-viz", "--answer-image-requests", "--url", url});
  ASSERT_TRUE(ReceiveUntil(&bus, [&] {
    if (status_.state != component_status_t::READY) Begin(&bus);
    return status_.state == component_status_t::READY;
  })) << process.err();
  image_request_.view[1].camera = "nowhere";
  bus.Publish(channels::kState, state_);
  bus.Publish(channels::kRequestImage, image_request_);
  ASSERT_TRUE(ReceiveUntil(&bus, [&] { return status_.state == component_status_t::FAILED; }));
  EXPECT_EQ(process.Wait(), 1);
  EXPECT_EQ(status_.error.find("REQUEST_IMAGE of tick 0: no camera 'nowhere'; this scene has head, "), 0u);
  EXPECT_NE(process.err().find("error: " + status_.error + "\n"), std::string::npos);
  EXPECT_TRUE(images.empty());
}

}  // namespace evalbus::camera_process_test
