#include "viz/web/listener.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/write.hpp>
#include <new>
#include <utility>

#include "tests/unit/viz/web/web_client.h"

namespace evalbus::viz::listener_test {

using tcp = boost::asio::ip::tcp;

TEST(Listener, AcceptsAgainAfterAnException) {
  Listener dut;
  dut.Listen({boost::asio::ip::make_address("127.0.0.1"), 0}, "127.0.0.1");
  std::atomic<int> taken = 0;
  dut.Start([&taken](tcp::socket socket) {
    if (++taken == 1) throw std::bad_alloc();
    boost::asio::write(socket, boost::asio::buffer("hello", 5));
  });
  EXPECT_EQ(AnswerTo(dut.port(), "first"), "");
  EXPECT_EQ(AnswerTo(dut.port(), "second"), "hello");
  EXPECT_EQ(taken, 2);
}

}  // namespace evalbus::viz::listener_test
