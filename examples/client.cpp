// A driver of the iiwa's line protocol in one file: POSIX sockets and nothing else.
//
//     c++ -std=c++17 -O2 examples/client.cpp -o client
//     ./client 127.0.0.1 30000
//
// It says where the robot is, moves the TCP 50 mm to the side on a straight line, polls until the robot has
// stopped, and moves back. Exit code 0 if all went well, 1 with a line on stderr if not.

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

// One connection. Each command is a line, and is answered by one line.
class Robot {
public:
    Robot(const std::string& host, const std::string& port, int timeout_s = 5) {
        addrinfo hints{};
        hints.ai_socktype = SOCK_STREAM;
        addrinfo* found = nullptr;
        if (const int fault = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); fault != 0)
            throw std::runtime_error(host + ": " + gai_strerror(fault));
        for (const addrinfo* each = found; each != nullptr && socket_ < 0; each = each->ai_next) {
            socket_ = socket(each->ai_family, each->ai_socktype, each->ai_protocol);
            if (socket_ >= 0 && connect(socket_, each->ai_addr, each->ai_addrlen) != 0) {
                close(socket_);
                socket_ = -1;
            }
        }
        freeaddrinfo(found);
        if (socket_ < 0) throw std::runtime_error("cannot connect to " + host + ":" + port);
        const timeval timeout{timeout_s, 0};
        const int on = 1;
        setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
        setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
        setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }

    // The robot stops if a move of this connection still runs.
    ~Robot() { close(socket_); }

    Robot(const Robot&) = delete;
    Robot& operator=(const Robot&) = delete;

    // The reply to a line, whatever it is.
    std::string ask(const std::string& line) {
        const std::string sent = line + "\r\n";
        for (size_t at = 0; at < sent.size();) {
            const ssize_t count = send(socket_, sent.data() + at, sent.size() - at, MSG_NOSIGNAL);
            if (count <= 0) throw std::runtime_error("the connection failed at '" + line + "'");
            at += static_cast<size_t>(count);
        }
        size_t end;
        while ((end = heard_.find("\r\n")) == std::string::npos) {
            char buffer[1024];
            const ssize_t count = recv(socket_, buffer, sizeof buffer, 0);
            if (count <= 0) throw std::runtime_error("no reply to '" + line + "'");
            heard_.append(buffer, static_cast<size_t>(count));
        }
        const std::string reply = heard_.substr(0, end);
        heard_.erase(0, end + 2);
        return reply;
    }

    // A command with its parameters that is to be answered `done`.
    void command(const std::string& name, const std::vector<double>& parameters) {
        std::ostringstream line;
        line << std::setprecision(12) << name << " :";
        for (const double each : parameters) line << ' ' << each;
        if (const std::string reply = ask(line.str()); reply != "done")
            throw std::runtime_error("'" + line.str() + "' was answered '" + reply + "'");
    }

    // The numbers that a `get` command answers.
    std::vector<double> numbers(const std::string& name, size_t expected) {
        const std::string reply = ask(name);
        std::istringstream words(reply);
        std::vector<double> values;
        for (double value; words >> value;) values.push_back(value);
        if (!words.eof() || values.size() != expected)
            throw std::runtime_error("'" + name + "' was answered '" + reply + "'");
        return values;
    }

    // `done` says that a move was accepted; the status says when it is over.
    void wait_until_stopped(std::chrono::seconds limit) {
        const auto deadline = std::chrono::steady_clock::now() + limit;
        while (ask("get status") != "stopped") {
            if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("the robot still moves");
            std::this_thread::sleep_for(std::chrono::milliseconds(20));  // 50 Hz
        }
    }

private:
    int socket_ = -1;
    std::string heard_;
};

static void print(const char* title, const std::vector<double>& values) {
    std::cout << title;
    for (const double value : values) std::cout << ' ' << value;
    std::cout << std::endl;
}

int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "usage: client HOST PORT" << std::endl;
        return 1;
    }
    try {
        Robot robot(arguments[1], arguments[2]);
        print("joints", robot.numbers("get joint position", 7));

        // x y z in mm, alpha beta gamma in rad (intrinsic Z-Y-X), of the TCP in the robot's base
        const std::vector<double> start = robot.numbers("get tool frame", 6);
        print("start", start);

        std::vector<double> target = start;
        target[1] += 50;
        const double speed = 0.5, blending_mm = 0;
        target.insert(target.end(), {speed, blending_mm});
        robot.command("lin move", target);
        robot.wait_until_stopped(std::chrono::seconds(30));
        print("there", robot.numbers("get tool frame", 6));

        std::vector<double> back = start;
        back.insert(back.end(), {speed, blending_mm});
        robot.command("ptp move", back);
        robot.wait_until_stopped(std::chrono::seconds(30));
        print("back", robot.numbers("get tool frame", 6));
        robot.ask("bye");
    } catch (const std::exception& fault) {
        std::cerr << fault.what() << std::endl;
        return 1;
    }
}
