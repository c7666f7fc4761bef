def main(path, picture):
    """Draw the picture, and print its numbers."""
    start, heights = time.perf_counter(), read(path)
    posts, triangles = mesh(heights)
    if "show_LESSON" in globals():
        pixels = globals()["show_LESSON"](heights, posts, triangles)
    else:
        colours = globals().get("paint_LESSON", paint)(heights, posts) * light(heights, posts)[:, None]
        pixels = draw(heights, posts, triangles, np.clip(colours, 0, 1))
    plt.imsave(picture, np.clip(pixels, 0, 1))
    worst, seconds = error_px(heights, posts, triangles), time.perf_counter() - start
    print(f"{len(triangles)} triangles, at most {worst:.1f} px off, {seconds:.1f} s")
    for name, values in {"report_LESSON": (heights,), "film_LESSON": (heights, picture)}.items():
        if name in globals():
            print(globals()[name](*values))


if __name__ == "__main__":
    main(*sys.argv[1:])
