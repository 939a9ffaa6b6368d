/* Triangles in a picture: which one is in front in every pixel. */
#include <math.h>
#include <stdint.h>

/* owner (height, width): triangle of the largest value at each pixel's middle, -1: none; best: that
   value, 0: none. xy (n, 2) in pixels, value (n) at the vertices, linear over the picture; faces
   (n_faces, 3). */
void rasterise(int64_t n_faces, const int64_t *faces, const double *xy, const double *value,
               int64_t width, int64_t height, int64_t *owner, double *best)
{
    for (int64_t k = 0; k < width * height; k++)
        owner[k] = -1, best[k] = 0.0;
    for (int64_t f = 0; f < n_faces; f++) {
        const int64_t *corner = faces + 3 * f;
        double x[3], y[3], z[3];
        for (int k = 0; k < 3; k++)
            x[k] = xy[2 * corner[k]], y[k] = xy[2 * corner[k] + 1], z[k] = value[corner[k]];
        double area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
        if (area == 0 || area != area)
            continue;
        double left = fmax(floor(fmin(x[0], fmin(x[1], x[2])) - 0.5), 0.0);
        double right = fmin(ceil(fmax(x[0], fmax(x[1], x[2])) + 0.5), (double)(width - 1));
        double top = fmax(floor(fmin(y[0], fmin(y[1], y[2])) - 0.5), 0.0);
        double bottom = fmin(ceil(fmax(y[0], fmax(y[1], y[2])) + 0.5), (double)(height - 1));
        for (int64_t row = (int64_t)top; row <= bottom; row++)
            for (int64_t column = (int64_t)left; column <= right; column++) {
                double px = column + 0.5, py = row + 0.5;
                double u = ((x[1] - px) * (y[2] - py) - (y[1] - py) * (x[2] - px)) / area;
                double v = ((x[2] - px) * (y[0] - py) - (y[2] - py) * (x[0] - px)) / area;
                if (u < 0 || v < 0 || u + v > 1)
                    continue;
                double depth = u * z[0] + v * z[1] + (1 - u - v) * z[2];
                if (depth > best[row * width + column]) {
                    best[row * width + column] = depth;
                    owner[row * width + column] = f;
                }
            }
    }
}
