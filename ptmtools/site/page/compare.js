function*U(h){let t=new Map;for(let u of h){let{texture:E,clampU:w,clampV:A,factor:p,blends:g,cutoff:y,twoSided:b}=u,d=[E,w,A,p,g,y,b].join(),l=t.get(d);l?l.push(u):t.set(d,[u])}let e=h.reduce((u,{positions:E})=>u+E.length/3,0),r=h.reduce((u,{indices:E})=>u+E.length,0),s=h.some(({colors:u})=>u),o=s?6:5,i=new Float32Array(o*e),n=new Uint8Array(i.buffer),a=e>65535?new Uint32Array(r):new Uint16Array(r),f=[],c=0,m=0;for(let u of t.values()){let E=m;for(let{positions:p,uvs:g,colors:y,indices:b}of u){yield;for(let d=0;d<b.length;d++)d%16384===16383&&(yield),a[m++]=c+b[d];for(let d=0;d<p.length/3;d++,c++){d%16384===16383&&(yield);for(let l=0;l<3;l++)i[o*c+l]=p[3*d+l];for(let l=0;s&&l<4;l++)n[24*c+20+l]=y?255*F(y[4*d+l]/65535)+.5:255;g&&(i[o*c+3]=g[2*d],i[o*c+4]=g[2*d+1])}}let[w]=u,A=[...w.factor.slice(0,3).map(F),w.factor[3]];for(let p=E;p<m;p+=6144){let g=a.subarray(p,Math.min(p+6144,m)),y=z(g,i,o);f.push({look:w,first:p*a.BYTES_PER_ELEMENT,count:g.length,color:A,...y}),yield}}return{data:i,painted:s,index:a,batches:f}}function z(h,t,e){let r=[1/0,1/0,1/0],s=[-1/0,-1/0,-1/0];for(let o=0;o<h.length;o++)for(let i=0,n=e*h[o];i<3;i++,n++)t[n]<r[i]&&(r[i]=t[n]),t[n]>s[i]&&(s[i]=t[n]);return{low:r,high:s}}var R=class{constructor(t,{data:e,painted:r,index:s,batches:o},i){this.gl=t,this.shapes=i,this.batches=o,this.bytes=e.byteLength+s.byteLength,this.type=s instanceof Uint32Array?t.UNSIGNED_INT:t.UNSIGNED_SHORT,this.vertexArray=t.createVertexArray(),this.buffers=[t.createBuffer(),t.createBuffer()],t.bindVertexArray(this.vertexArray),t.bindBuffer(t.ARRAY_BUFFER,this.buffers[0]),t.bufferData(t.ARRAY_BUFFER,e,t.STATIC_DRAW),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,this.buffers[1]),t.bufferData(t.ELEMENT_ARRAY_BUFFER,s,t.STATIC_DRAW);let n=r?24:20;t.enableVertexAttribArray(0),t.vertexAttribPointer(0,3,t.FLOAT,!1,n,0),t.enableVertexAttribArray(1),t.vertexAttribPointer(1,2,t.FLOAT,!1,n,12),t.vertexAttrib4f(2,1,1,1,1),r&&(t.enableVertexAttribArray(2),t.vertexAttribPointer(2,4,t.UNSIGNED_BYTE,!0,n,20)),t.bindVertexArray(null)}draw(t){this.gl.drawElements(this.gl.TRIANGLES,t.count,this.type,t.first)}delete(){this.gl.deleteVertexArray(this.vertexArray);for(let t of this.buffers)this.gl.deleteBuffer(t)}};function F(h){return h<=.0031308?12.92*h:1.055*h**(1/2.4)-.055}var I=`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens; // 1/tan across, 1/tan up, and of depth: scale, offset
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 place;
layout(location = 2) in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;
void main() {
  painted = paint.rgb;
  seen = turn * (position - eye);
  uv = place;
  gl_Position = vec4(seen.xy * lens.xy, seen.z * lens.z + lens.w, -seen.z);
}`,Y=`
uniform sampler2D map;
uniform int channels; // 0: no level is present
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel() {
  vec4 sampled = texture(map, uv);
  if (channels == 1) sampled = vec4(sampled.rrr, 1.0);
  if (channels == 2) sampled = sampled.rrrg;
  return channels == 0 ? vec4(mean, 1.0) : sampled;
}`,j=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${Y}
void main() {
  vec4 sampled = texel();
  float light = 1.0;
  if (!textured) {
    vec3 normal = cross(dFdx(seen), dFdy(seen));
    float size = length(normal);
    light = 0.25 + 0.75 * (size > 0.0 ? abs(dot(normal, normalize(seen))) / size : 1.0);
    sampled = vec4(1.0);
  }
  shown = vec4(sampled.rgb * color.rgb * painted * light, sampled.a * color.a);
  if (shown.a < max(cutoff, 0.004)) discard;
  if (cutoff > 0.0) shown.a = 1.0;
}`,C=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,W=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size; // texels of the finest level
uniform float pixels; // of the screen, for one of the item buffer
out vec4 shown;
${C}
void main() {
  float w = gl_FragCoord.w;
  vec2 texels = uv * size;
  vec2 across = (dFdx(texels * w) - texels * dFdx(w)) / w;
  vec2 up = (dFdy(texels * w) - texels * dFdy(w)) / w;
  float most = max(dot(across, across), dot(up, up));
  float detail = 0.5 * log2(max(most, 1e-30)) - log2(pixels);
  shown = vec4(bytes(item), bytes(floor(256.0 * clamp(detail, 0.0, 31.0))));
}`,q=`#version 300 es
precision highp float;
uniform float item;
layout(location = 1) out vec4 shown;
${C}
void main() { shown = vec4(bytes(item), 0.0, 1.0); }`,B={surface:[I,j],item:[I,W],placeholder:[I,q]};function L(h,t){let e=h.createProgram(),r=[h.VERTEX_SHADER,h.FRAGMENT_SHADER];if(B[t].forEach((i,n)=>{let a=h.createShader(r[n]);h.shaderSource(a,i),h.compileShader(a),h.attachShader(e,a),h.deleteShader(a)}),h.linkProgram(e),!h.getProgramParameter(e,h.LINK_STATUS)&&!h.isContextLost())throw new Error(`${t}: ${h.getProgramInfoLog(e)}`);let s={},o=h.isContextLost()?0:h.getProgramParameter(e,h.ACTIVE_UNIFORMS);for(let i=0;i<o;i++){let n=h.getActiveUniform(e,i)?.name??"";s[n]=h.getUniformLocation(e,n)}return{program:e,at:s}}function P(h,{program:t,at:e},r){h.useProgram(t),h.uniform3fv(e.eye,r.eye),h.uniformMatrix3fv(e.turn,!1,r.turn),h.uniform4fv(e.lens,r.lens)}var O=[.16,.17,.19,1],_=class{cells=new Map;#t=new Map;constructor(t,e,r){this.gl=t,this.memory=e,this.means=r.map(s=>s.map(o=>o/255)),this.surface=L(t,"surface")}add(t,e,r){let s=this.#t.get(t)??{shapes:e,steps:U(e)};this.#t.set(t,s);let{steps:o}=s,i=o.next();for(;!i.done;){if(r())return!1;i=o.next()}return this.#t.delete(t),this.cells.get(t)?.delete(),this.cells.set(t,new R(this.gl,i.value,s.shapes)),!0}keep(t){for(let[e,r]of this.cells)t.has(e)||(r.delete(),this.cells.delete(e));for(let e of this.#t.keys())t.has(e)||this.#t.delete(e)}delete(){this.keep(new Set),this.gl.deleteProgram(this.surface.program)}get bytes(){let t=0;for(let{bytes:e}of this.cells.values())t+=e;return t}draw(t,e,r){let{gl:s,surface:o}=this;s.clearColor(O[0],O[1],O[2],1),s.depthMask(!0),s.clear(s.COLOR_BUFFER_BIT|s.DEPTH_BUFFER_BIT),s.enable(s.DEPTH_TEST),s.disable(s.BLEND),P(s,o,t);let i=!1,n=[];for(let{buffers:a,batches:f}of e){s.bindVertexArray(a.vertexArray);for(let c of f)c.look.blends?n.push({buffers:a,batch:c,far:$(t.eye,c)}):i=this.#e(a,c,r)||i}if(n.length){s.enable(s.BLEND),s.blendFuncSeparate(s.SRC_ALPHA,s.ONE_MINUS_SRC_ALPHA,s.ONE,s.ONE_MINUS_SRC_ALPHA),s.depthMask(!1);for(let{buffers:a,batch:f}of n.sort((c,m)=>m.far-c.far))s.bindVertexArray(a.vertexArray),i=this.#e(a,f,r)||i;s.depthMask(!0)}return s.bindVertexArray(null),i}#e(t,e,r){let{gl:s}=this,{at:o}=this.surface,{texture:i,clampU:n,clampV:a,cutoff:f,twoSided:c}=e.look;(c?s.disable:s.enable).call(s,s.CULL_FACE),s.uniform4fv(o.color,e.color),s.uniform1f(o.cutoff,f),s.uniform1i(o.textured,+(i>=0));let m=i<0?null:this.memory.of(i);s.uniform1i(o.channels,m?.channels??0),i>=0&&s.uniform3fv(o.mean,this.means[i]);let u=m?.bind(n,a,r)??!1;return t.draw(e),u}};function $(h,{low:t,high:e}){return Math.hypot(...h.map((r,s)=>(t[s]+e[s])/2-r))}function G(h,t,e){if(!e)return h;let r=new Uint8ClampedArray(h),s=t-+(t>1);for(let o=0;o<r.length;o+=t)for(let i=o;i<o+s;i++)r[i]+=e;return new Uint8Array(r.buffer)}var J=262144,Q=.3;function H(h,t){return t===1?{inside:h.R8,outside:h.RED}:t===2?{inside:h.RG8,outside:h.RG}:{inside:h.RGBA8,outside:h.RGBA}}var S=class{#t=0;#e=0;#s=-1;constructor(t,e,r){this.gl=t,this.sizes=e,this.channels=r,this.texture=t.createTexture(),this.bytes=e.reduce((i,{width:n,height:a})=>i+n*a*r,0);let{width:s,height:o}=e[e.length-1];t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,e.length,H(t,r).inside,s,o),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_LINEAR),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.LINEAR)}get levels(){return this.sizes.length}upload(t,e,r,s){let{gl:o,channels:i}=this,{width:n,height:a}=this.sizes[t],f=Math.min(a-r,Math.max(1,Math.floor(J/(n*i)))),c=e.subarray(r*n*i,(r+f)*n*i);return o.bindTexture(o.TEXTURE_2D,this.texture),o.pixelStorei(o.UNPACK_ALIGNMENT,1),o.texSubImage2D(o.TEXTURE_2D,this.levels-1-t,0,r,n,f,H(o,i).outside,o.UNSIGNED_BYTE,G(c,i,s)),r+f}fadeIn(t,e){this.#t=t,this.#e=e}bind(t,e,r){let{gl:s}=this,o=+t+2*+e;if(s.bindTexture(s.TEXTURE_2D,this.texture),o!==this.#s){let[n,a]=[t,e].map(f=>f?s.CLAMP_TO_EDGE:s.REPEAT);s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,n),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,a),this.#s=o}if(!this.#t)return!1;let i=this.#t*Math.max(0,1-(r-this.#e)/Q);return s.texParameterf(s.TEXTURE_2D,s.TEXTURE_MIN_LOD,i>0?i:-1e3),i===0&&(this.#t=0),i>0}delete(){this.gl.deleteTexture(this.texture)}};var Z=3,tt=6,k=class{images=null;loss=0;storage=null;level=0;row=0;constructor(t,e){this.texture=t,this.to=e,this.inside=!1}},N=class{#t;#e=new Map;#s=new Int32Array(0);#c=new Float64Array(0);#i;#r;constructor(t,e,r){this.gl=t,this.rows=e,this.decode=r,this.#t=e.map(()=>null),this.held=new Int32Array(e.length),this.loss=new Float64Array(e.length),this.#i=new Float64Array(e.length),this.#r=new Int32Array(e.length),this.budget=1/0,this.bytes=0,this.peak=0,this.fades=!0}of(t){return this.#t[t]}settle(t,e,r){this.#s=t,this.#i=r,this.#r.fill(0),this.#c=e;for(let n=0;n<t.length;n++)t[n]===0&&this.held[n]&&this.#h(n);let s=[...t.keys()].filter(n=>this.held[n]>t[n]);s.sort((n,a)=>e[n]-e[a]);let o=[...this.#e.values()].some(({storage:n,inside:a})=>n&&!a),i=Math.min(...s.map(n=>this.#l(n,t[n])));for(let n of s){if(this.bytes<=this.budget&&(o||this.bytes+i<=this.budget))break;this.#h(n)}this.#o()}hold(){this.#s=this.held.map((t,e)=>Math.max(t,Math.min(this.#s[e]??0,this.#r[e]))),this.#i=this.loss.slice()}resume(){this.#o()}#u(t,e){let r=-1;for(let s=0;s<this.rows.length;s++)t(s)&&(r<0||e(s)>e(r))&&(r=s);return r}#d(t){return this.held[t]>0&&this.held[t]===this.#s[t]&&this.#i[t]<this.loss[t]}#a(t){let e=this.held[t],r=this.#s[t];return r<e?2:e===0?1:r>e?0:-1}#o(){let{held:t}=this,e=this.#s,r=this.#c;for(;;){let s=[...this.#e.values()];if(s.filter(({images:a})=>!a).length>=Z)return;let o=s.length<tt,i=this.#u(a=>e[a]>0&&!this.#e.has(a)&&(e[a]<t[a]||o&&(e[a]>t[a]||this.#d(a))),a=>r[a]+this.#a(a));if(i<0)return;let n=new k(i,e[i]);this.#e.set(i,n),this.decode(i,e[i]).then(({images:a,loss:f})=>{Object.assign(n,{images:a,loss:f}),this.#o()},()=>this.#n(n))}}#n(t){this.#e.get(t.texture)===t&&(t.storage&&!t.inside&&this.#f(t.storage),this.#e.delete(t.texture))}#h(t){let e=this.#t[t];e&&this.#f(e),this.#t[t]=null,this.held[t]=0}pump(t,e){let r=!1,s=[...this.#e.values()];s.sort((o,i)=>this.#a(i.texture)-this.#a(o.texture));for(let o of s){for(;!e()&&this.#m(o,t);)r=!0;if(e())break}return r&&this.#o(),r}#m(t,e){let{texture:r,to:s,images:o,loss:i}=t,n=this.held[r],{offsets:a}=this.rows[r];if(!o||this.#e.get(r)!==t)return!1;let f=this.#s[r],c=s===n&&i<this.loss[r];if(f===0||s>f||s<=n&&f>=n&&!c)return this.#n(t),!1;t.storage||(t.inside=c,t.storage=c?this.#t[r]:this.#p(r,s));let{storage:m}=t;if(!m||t.inside&&m!==this.#t[r])return m&&this.#n(t),!1;let{level:u,row:E}=t,{data:w,height:A}=o[u];return t.row=m.upload(u,w,E,a[u]),t.row>=A&&(t.row=0,t.level++),t.level<s||(this.#e.delete(r),this.loss[r]=i,t.inside)||(this.#h(r),this.#t[r]=m,this.held[r]=s,this.fades&&n>0&&s>n&&m.fadeIn(s-n,e)),!0}#p(t,e){let{sizes:r,channels:s}=this.rows[t],o=this.#l(t,e),i=e<this.held[t]?0:this.#y();return this.bytes+o+i>this.budget?null:(this.bytes+=o,this.peak=Math.max(this.peak,this.bytes),new S(this.gl,r.slice(0,e),s))}#l(t,e){let{sizes:r,channels:s}=this.rows[t];return r.slice(0,e).reduce((o,i)=>o+i.width*i.height*s,0)}#y(){return this.#s.reduce((t,e,r)=>e<this.held[r]?Math.max(t,this.#l(r,e)):t,0)}#f(t){this.bytes-=t.bytes,t.delete()}delete(){this.#s=new Int32Array(this.rows.length);for(let t of[...this.#e.values()])this.#n(t);for(let t=0;t<this.rows.length;t++)this.#h(t)}lose(){this.#r=this.held.map((t,e)=>Math.max(t,this.#r[e])),this.#t.fill(null),this.#e.clear(),this.held.fill(0),this.bytes=0}};var D=.2,X=8e3,Lt=2**20;function K(h,t){let e=0,r=0;for(let o of t)e+=Math.max(o.left,0),r+=+!o.waits;let s=h.latency+D/2;return r<h.concurrency&&(e===0||8*e<s*h.bandwidth)}var V=class{constructor(t){let{gl:e,rows:r,stream:s,means:o}=t;this.walk=t,this.memory=new N(e,r,(i,n)=>s.decode(i,n)),this.memory.fades=!1,this.renderer=new _(e,this.memory,o)}settle(){let{walk:t,memory:e}=this,{client:r,catalogue:s,present:o,estimate:i}=t,{T:n,K:a,levels:f,stored:c,ends:m,previews:{first:u,column:E,loss:w}}=s;if(!o)return!1;let A=new Int32Array(n),p=new Float64Array(n),g=new Float64Array(n),{downloads:y}=r,b=Math.max(X,D*i.bandwidth/8),d=[];for(let l=0;l<n;l++){p[l]=o[l*a+1];let x=f[l],v=-1;for(;x>0&&!(o[l*a+x]>0);)x--;A[l]=Math.min(x,y.reach(l).last),g[l]=y.loss(l,A[l]);for(let T=u[l];x>c[l]&&T<u[l+1];T++)E[T]>=x&&(v<0||w[T]<w[v])&&(v=T);let M=v<0?0:w[v];(e.held[l]<x||x>0&&e.loss[l]>M)&&d.push({texture:l,end:m[l*a+x],preview:v})}e.settle(A,p,g),d.sort((l,x)=>p[x.texture]-p[l.texture]);for(let{texture:l,end:x,preview:v}of d){if(!K(i,y.waiting))break;if(v>=0){y.free("preview",v)&&t.stream.ask(y.ask("preview",v,p[l]));continue}let M=Math.min(x,Math.floor(y.bytes[l]+b));M<=y.bytes[l]||!y.free("texture",l)||t.stream.ask(y.ask("texture",l,p[l],M))}return d.length===0}delete(){this.memory.delete(),this.renderer.delete()}};export{V as Comparison};
