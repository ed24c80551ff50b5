#include "bus/component.h"

#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <random>

#include "base/errors.h"
#include "bus/channels.h"
#include "lcmtypes/plausible.h"

namespace evalbus {
namespace {

constexpr auto kHeartbeat = std::chrono::milliseconds(400);
constexpr auto kPollPeriod = std::chrono::milliseconds(100);

volatile std::sig_atomic_t g_stop = 0;

}  // namespace

Component::Component(Bus* bus, std::string name, int64_t lag_window_ticks) : bus_(bus) {
  status_.component = std::move(name);
  std::random_device random;
  status_.instance = static_cast<int64_t>(uint64_t{random()} << 32 | random());
  status_.state = component_status_t::IDLE;
  status_.episode = status_.attempt = status_.last_finished_episode = -1;
  status_.last_tick = -1;
  status_.lag_window_ticks = lag_window_ticks;
}

void Component::Poll(SteadyTime now) {
  if (now - last_published_ >= kHeartbeat) PublishStatus();
}

void Component::PublishStatus() {
  status_.decode_errors = bus_->decode_errors();
  bus_->Publish(channels::kStatus, status_);
  last_published_ = std::chrono::steady_clock::now();
  last_published_tick_ = status_.last_tick;
}

void Component::Fail(const std::string& error) {
  status_.state = component_status_t::FAILED;
  status_.error = error;
  PublishStatus();
}

void Component::Stop() {
  if (status_.state != component_status_t::FAILED) status_.state = component_status_t::STOPPED;
  PublishStatus();
}

bool Component::EnterEpisode(const episode_begin_t& begin) {
  if (begin.header.episode == status_.episode && begin.attempt == status_.attempt && begin.seed == seed_) {
    PublishStatus();
    return false;
  }
  status_.state = component_status_t::IDLE;
  status_.episode = begin.header.episode;
  status_.attempt = begin.attempt;
  seed_ = begin.seed;
  status_.last_tick = last_published_tick_ = -1;
  // An attempt before this one may have been finished.
  if (status_.last_finished_episode == begin.header.episode) status_.last_finished_episode = -1;
  return true;
}

void Component::SayReady() {
  status_.state = component_status_t::READY;
  PublishStatus();
}

bool Component::IsOurs(const header_t& header) {
  if (header.episode == status_.episode && IsPlausible(header)) return true;
  ++status_.foreign_messages;
  return false;
}

void Component::Progress(int64_t tick) {
  status_.last_tick = tick;
  if (status_.lag_window_ticks > 0 && tick - last_published_tick_ >= status_.lag_window_ticks / 2)
    PublishStatus();
}

void InstallStopSignals() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };  // no SA_RESTART: a wait for messages ends at once
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool stop_requested() { return g_stop != 0; }

int Host(const std::string& url, const ComponentFactory& make) {
  InstallStopSignals();
  std::unique_ptr<Bus> bus;
  std::unique_ptr<Component> component;
  try {
    bus = std::make_unique<Bus>(url);
    component = make(bus.get());
    std::cout << "ready" << std::endl;
    while (!stop_requested() && !component->done()) {
      const auto now = std::chrono::steady_clock::now();
      component->Poll(now);
      bus->Handle(std::min(component->next_poll(), now + kPollPeriod));
    }
    component->Stop();
    return 0;
  } catch (const std::exception& error) {
    const int code = ReportError(error);
    try {
      if (component) component->Fail(error.what());
    } catch (const std::exception&) {
      // The bus itself is what failed; the exit code says so.
    }
    return code;
  }
}

std::optional<int> ParseArguments(CLI::App* app, int argc, char** argv) {
  try {
    app->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::CallForHelp& help) {
    return app->exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: " << error.what() << " (--help lists the options)\n";
    return 1;
  }
}

int HostMain(int argc, char** argv, const std::string& description,
             const std::function<void(CLI::App*)>& add_options, const ComponentFactory& make) {
  CLI::App app{description};
  std::string url;
  app.add_option("--url", url,
                 "bus to work on, udpm://ADDRESS:PORT?ttl=0; all processes of a run name the same one")
      ->envname("EVALBUS_URL")
      ->required();
  add_options(&app);
  if (const auto code = ParseArguments(&app, argc, argv)) return *code;
  return Host(url, make);
}

}  // namespace evalbus
