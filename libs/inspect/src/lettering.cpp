// A stroke alphabet on a grid: the base line is row 2, small letters reach row 6, capitals row 8, descenders row 0.
#include "toile/inspect/image.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace toile::inspect {
namespace {

struct Letter {
  double width;         ///< [grid units]
  const char* strokes;  ///< pairs of digits: column, row; a blank begins the next polyline
};

const Letter unknown{4, "0208484202"};
constexpr char degree_sign = '\x01';  // stands for the two bytes of the sign

const std::map<char, Letter>& alphabet() {
  static const std::map<char, Letter> letters{
      {'0', {4, "120307183847433212"}}, {'1', {2, "072822"}}, {'2', {4, "07183847460242"}},
      {'3', {4, "0718384746354443321203 1535"}}, {'4', {4, "32380444"}}, {'5', {4, "480805354443321203"}},
      {'6', {4, "4738180703123243443505"}}, {'7', {4, "084812"}}, {'8', {4, "15060718384746351504031232434435"}},
      {'9', {4, "0312324347381807061545"}},
      {'a', {3, "3632 3526160503122233"}}, {'b', {3, "0802 0516263533221203"}}, {'c', {3, "3526160503122233"}},
      {'d', {3, "3832 3526160503122233"}}, {'e', {3, "04343526160503122233"}}, {'f', {2, "281712 0626"}},
      {'g', {3, "3631201001 3526160503122233"}}, {'h', {3, "0802 0516263532"}}, {'i', {0, "0602 0808"}},
      {'j', {1, "161100 1818"}}, {'k', {3, "0802 3603 1432"}}, {'l', {0, "0802"}}, {'m', {4, "0602 05162522 25364542"}},
      {'n', {3, "0602 0516263532"}}, {'o', {3, "120305162635332212"}}, {'p', {3, "0600 0516263533221203"}},
      {'q', {3, "3630 3526160503122233"}}, {'r', {2, "0602 051626"}}, {'s', {3, "3616051424332202"}},
      {'t', {2, "181322 0626"}}, {'u', {3, "0603122233 3632"}}, {'v', {4, "062246"}}, {'w', {4, "0612253246"}},
      {'x', {3, "0632 3602"}}, {'y', {4, "0622 4610"}}, {'z', {3, "06360232"}},
      {'A', {4, "022842 1434"}}, {'B', {4, "02083847463505 3544433202"}}, {'C', {4, "4738180703123243"}},
      {'D', {4, "02083847433202"}}, {'E', {4, "48080242 0535"}}, {'F', {4, "480802 0535"}}, {'G', {4, "47381807031232434525"}},
      {'H', {4, "0802 4842 0545"}}, {'I', {0, "0802"}}, {'J', {4, "4843321203"}}, {'K', {4, "0802 4804 1542"}},
      {'L', {4, "080242"}}, {'M', {4, "0208254842"}}, {'N', {4, "02084248"}}, {'O', {4, "120307183847433212"}},
      {'P', {4, "02083847463505"}}, {'Q', {4, "120307183847433212 2442"}}, {'R', {4, "02083847463505 2542"}},
      {'S', {4, "473818070615354443321203"}}, {'T', {4, "0848 2822"}}, {'U', {4, "080312324348"}}, {'V', {4, "082248"}},
      {'W', {4, "0812263248"}}, {'X', {4, "0842 4802"}}, {'Y', {4, "0825 4825 2522"}}, {'Z', {4, "08480242"}},
      {' ', {2.5, ""}}, {'.', {0, "0202"}}, {',', {1, "1201"}}, {':', {0, "0202 0505"}}, {';', {1, "1201 1515"}},
      {'-', {3, "0535"}}, {'+', {4, "0545 2723"}}, {'_', {4, "0141"}}, {'/', {3, "0238"}}, {'(', {1, "18060412"}},
      {')', {1, "08161402"}}, {'%', {4, "0248 0807171808 3332424333"}}, {'=', {4, "0646 0444"}}, {'*', {2, "0626 1715"}},
      {'<', {3, "370533"}}, {'>', {3, "073503"}}, {'|', {0, "0901"}}, {'\'', {0, "0807"}}, {'!', {0, "0804 0202"}},
      {'?', {4, "071838474624 2222"}}, {'#', {4, "1812 3832 0646 0444"}},
      {'[', {1, "18080111"}}, {']', {1, "08181101"}}, {degree_sign, {2, "0718271607"}},
  };
  return letters;
}

std::string one_byte_each(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.substr(i, 2) == "\xC2\xB0") {
      result += degree_sign;
      ++i;
    } else if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) {
      result += text[i];  // continuation bytes of an unknown letter add no box of their own
    }
  }
  return result;
}

const Letter& letter(char c) {
  const auto it = alphabet().find(c);
  return it == alphabet().end() ? unknown : it->second;
}

constexpr double spacing = 1.7;       // between letters [grid units]
constexpr double capital_rows = 6.0;  // base line to top of a capital [grid units]

}  // namespace

double text_width(double height, std::string_view text) {
  double width = 0;
  const std::string letters = one_byte_each(text);
  for (const char c : letters) width += letter(c).width + spacing;
  return letters.empty() ? 0 : (width - spacing) * height / capital_rows;
}

void draw_text(Image& image, double x, double y, double height, const Srgb& color, std::string_view text) {
  const double unit = height / capital_rows;
  const double width = std::max(1.0, 0.75 * unit);
  for (const char c : one_byte_each(text)) {
    const Letter& shape = letter(c);
    bool pen_down = false;
    double px = 0, py = 0;
    for (const char* s = shape.strokes; *s != '\0';) {
      if (*s == ' ') {
        pen_down = false;
        ++s;
        continue;
      }
      const double qx = x + (s[0] - '0') * unit, qy = y - (s[1] - '2') * unit;
      // A point is a little thicker than a line, or small letters lose it.
      if (pen_down) draw_stroke(image, px, py, qx, qy, px == qx && py == qy ? std::max(1.5 * width, 2.0) : width, color);
      px = qx;
      py = qy;
      pen_down = true;
      s += 2;
    }
    x += (shape.width + spacing) * unit;
  }
}

void draw_stroke(Image& image, double x0, double y0, double x1, double y1, double width, const Srgb& color) {
  const double radius = 0.5 * width + 0.5;
  const int left = std::max(0, static_cast<int>(std::floor(std::min(x0, x1) - radius)));
  const int right = std::min(image.width - 1, static_cast<int>(std::ceil(std::max(x0, x1) + radius)));
  const int top = std::max(0, static_cast<int>(std::floor(std::min(y0, y1) - radius)));
  const int bottom = std::min(image.height - 1, static_cast<int>(std::ceil(std::max(y0, y1) + radius)));
  const double dx = x1 - x0, dy = y1 - y0, length_sq = dx * dx + dy * dy;
  for (int j = top; j <= bottom; ++j) {
    for (int i = left; i <= right; ++i) {
      const double px = i + 0.5 - x0, py = j + 0.5 - y0;
      const double t = length_sq > 0 ? std::clamp((px * dx + py * dy) / length_sq, 0.0, 1.0) : 0.0;
      const double distance = std::hypot(px - t * dx, py - t * dy);
      const double cover = std::clamp(radius - distance, 0.0, 1.0);
      if (cover <= 0) continue;
      std::uint8_t* p = image.pixel(i, j);
      for (int k = 0; k < 3; ++k) {
        p[k] = static_cast<std::uint8_t>(std::lround(p[k] + cover * (255 * color[static_cast<std::size_t>(k)] - p[k])));
      }
    }
  }
}

void fill_rectangle(Image& image, int x0, int y0, int x1, int y1, const Srgb& color) {
  for (int j = std::max(0, y0); j < std::min(image.height, y1); ++j) {
    for (int i = std::max(0, x0); i < std::min(image.width, x1); ++i) {
      for (int k = 0; k < 3; ++k) image.pixel(i, j)[k] = static_cast<std::uint8_t>(std::lround(255 * color[static_cast<std::size_t>(k)]));
    }
  }
}

}  // namespace toile::inspect
